// Cameras in the files of OpenCV and ROS, and in our own.
#include "config/camera_exchange.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <opencv2/core.hpp>

#include "config/camera_file.h"

namespace zeropose {
namespace {

using testing::HasSubstr;

// Numbers with all digits, tiny and whole ones.
const CameraModel brown{2448,
                        2048,
                        1.0 / 3,
                        2300,
                        1223.5,
                        1e3 / 7,
                        BrownConrady{-0.1234567890123456, 1e-17, -3.3e-5, 0, 2.0 / 3}};

void expect_same(const CameraModel& a, const CameraModel& b) {
  EXPECT_EQ(a.width_px, b.width_px);
  EXPECT_EQ(a.height_px, b.height_px);
  EXPECT_EQ(a.fx_px, b.fx_px);
  EXPECT_EQ(a.fy_px, b.fy_px);
  EXPECT_EQ(a.cx_px, b.cx_px);
  EXPECT_EQ(a.cy_px, b.cy_px);
  const auto& p = std::get<BrownConrady>(a.distortion);
  const auto& q = std::get<BrownConrady>(b.distortion);
  EXPECT_EQ(p.k1, q.k1);
  EXPECT_EQ(p.k2, q.k2);
  EXPECT_EQ(p.p1, q.p1);
  EXPECT_EQ(p.p2, q.p2);
  EXPECT_EQ(p.k3, q.k3);
}

std::string mistake_of(const std::string& text) {
  try {
    parse_yaml_camera(text, "camera.yml");
  } catch (const ConfigError& error) {
    return error.what();
  }
  return "none";
}

const std::string ros_text = R"(image_width: 640
image_height: 480
camera_name: narrow_stereo/left
camera_matrix:
  rows: 3
  cols: 3
  data: [580.46715,    0.     ,  315.27153,
           0.     ,  576.62721,  247.47257,
           0.     ,    0.     ,    1.     ]
distortion_model: plumb_bob
distortion_coefficients:
  rows: 1
  cols: 5
  data: [0.134462, -0.311908, 0.002304, 0.003083, 0.000000]
rectification_matrix:
  rows: 3
  cols: 3
  data: [1., 0., 0., 0., 1., 0., 0., 0., 1.]
projection_matrix:
  rows: 3
  cols: 4
  data: [587.7, 0., 316.8, 0., 0., 585.7, 248.3, 0., 0., 0., 1., 0.]
)";

std::string replaced(std::string text, const std::string& from, const std::string& to) {
  const std::size_t at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  return at == std::string::npos ? text : text.replace(at, from.size(), to);
}

TEST(CameraExchange, OpenCvReadsWhatWeWrite) {
  cv::FileStorage file(opencv_camera_text(brown), cv::FileStorage::READ | cv::FileStorage::MEMORY);
  cv::Mat K, D;
  file["camera_matrix"] >> K;
  file["distortion_coefficients"] >> D;
  EXPECT_EQ(static_cast<int>(file["image_width"]), 2448);
  EXPECT_EQ(static_cast<int>(file["image_height"]), 2048);
  ASSERT_EQ(K.size(), cv::Size(3, 3));
  ASSERT_EQ(D.total(), 5u);
  // cv::FileStorage has a number parser of its own, which may round the last bit the other way.
  EXPECT_DOUBLE_EQ(K.at<double>(0, 0), 1.0 / 3);
  EXPECT_EQ(K.at<double>(1, 1), 2300);
  EXPECT_EQ(K.at<double>(0, 2), 1223.5);
  EXPECT_DOUBLE_EQ(K.at<double>(1, 2), 1e3 / 7);
  EXPECT_EQ(K.at<double>(2, 2), 1);
  EXPECT_DOUBLE_EQ(D.at<double>(0), -0.1234567890123456);
  EXPECT_DOUBLE_EQ(D.at<double>(1), 1e-17);
  EXPECT_DOUBLE_EQ(D.at<double>(2), -3.3e-5);
  EXPECT_EQ(D.at<double>(3), 0);
  EXPECT_DOUBLE_EQ(D.at<double>(4), 2.0 / 3);
}

TEST(CameraExchange, WeReadWhatOpenCvWrites) {
  const auto& lens = std::get<BrownConrady>(brown.distortion);
  const cv::Mat K =
      (cv::Mat_<double>(3, 3) << brown.fx_px, 0, brown.cx_px, 0, brown.fy_px, brown.cy_px, 0, 0, 1);
  const cv::Mat D = (cv::Mat_<double>(1, 5) << lens.k1, lens.k2, lens.p1, lens.p2, lens.k3);
  cv::FileStorage file("camera.yml", cv::FileStorage::WRITE | cv::FileStorage::MEMORY);
  file << "calibration_time"
       << "Mon 01 Jan 2024 10:00:00"
       << "image_width" << 2448 << "image_height" << 2048 << "camera_matrix" << K << "distortion_coefficients"
       << D << "avg_reprojection_error" << 0.25;
  expect_same(parse_yaml_camera(file.releaseAndGetString(), "camera.yml").model, brown);
}

TEST(CameraExchange, RoundTripsAreExact) {
  expect_same(parse_yaml_camera(opencv_camera_text(brown), "a.yml").model, brown);
  const CalibratedCamera ros = parse_yaml_camera(ros_camera_text(brown, "left"), "a.yaml");
  expect_same(ros.model, brown);
  EXPECT_EQ(ros.name, "left");
}

TEST(CameraExchange, NamesThatYamlWouldTakeForSomethingElse) {
  for (const std::string name :
       {"left", "no", "12", "a: b", "x#1", "", "with \"quotes\"", "narrow_stereo/left"})
    EXPECT_EQ(parse_yaml_camera(ros_camera_text(brown, name), "a.yaml").name, name);
  EXPECT_THAT(ros_camera_text(brown, "no"), HasSubstr("camera_name: \"no\"\n"));
}

TEST(CameraExchange, RosTextAsRosWritesIt) {
  const CalibratedCamera camera = parse_yaml_camera(ros_text, "left.yaml");
  EXPECT_EQ(camera.name, "narrow_stereo/left");
  expect_same(camera.model, {640, 480, 580.46715, 576.62721, 315.27153, 247.47257,
                             BrownConrady{0.134462, -0.311908, 0.002304, 0.003083, 0}});
  EXPECT_TRUE(camera.X_WC.matrix().isIdentity(0));
  const CameraModel plain{640, 480, 500, 501, 320, 240, BrownConrady{-0.25, 0.5, 0, 0, 0}};
  EXPECT_EQ(ros_camera_text(plain, "left"), R"(image_width: 640
image_height: 480
camera_name: left
camera_matrix:
  rows: 3
  cols: 3
  data: [500.0, 0.0, 320.0,
         0.0, 501.0, 240.0,
         0.0, 0.0, 1.0]
distortion_model: plumb_bob
distortion_coefficients:
  rows: 1
  cols: 5
  data: [-0.25, 0.5, 0.0, 0.0, 0.0]
rectification_matrix:
  rows: 3
  cols: 3
  data: [1.0, 0.0, 0.0,
         0.0, 1.0, 0.0,
         0.0, 0.0, 1.0]
projection_matrix:
  rows: 3
  cols: 4
  data: [500.0, 0.0, 320.0, 0.0,
         0.0, 501.0, 240.0, 0.0,
         0.0, 0.0, 1.0, 0.0]
)");
}

TEST(CameraExchange, OtherKeysForTheSame) {
  const std::string tutorial = R"(%YAML:1.0
image_Width: 640
image_Height: 480
Camera_Matrix: !!opencv-matrix
   rows: 3
   cols: 3
   dt: d
   data: [ 500., 0., 320., 0., 501., 240., 0., 0., 1. ]
Distortion_Coefficients: !!opencv-matrix
   rows: 4
   cols: 1
   dt: d
   data: [ -0.25, 0.5, 0.01, 0.02 ]
)";
  const std::string interactive = R"(%YAML:1.0
---
cameraResolution: [ 640, 480 ]
cameraMatrix: !!opencv-matrix
   rows: 3
   cols: 3
   dt: d
   data: [ 500., 0., 320., 0., 501., 240., 0., 0., 1. ]
dist_coeffs: !!opencv-matrix
   rows: 8
   cols: 1
   dt: d
   data: [ -0.25, 0.5, 0.01, 0.02, 0., 0., 0., 0. ]
)";
  const std::string message = R"(height: 480
width: 640
distortion_model: rational_polynomial
D: [-0.25, 0.5, 0.01, 0.02, 0.0, 0.0, 0.0, 0.0]
K: [500.0, 0.0, 320.0, 0.0, 501.0, 240.0, 0.0, 0.0, 1.0]
R: [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0]
binning_x: 0
binning_y: 0
roi: {x_offset: 0, y_offset: 0, height: 0, width: 0, do_rectify: false}
)";
  const CameraModel wanted{640, 480, 500, 501, 320, 240, BrownConrady{-0.25, 0.5, 0.01, 0.02, 0}};
  for (const std::string& text : {tutorial, interactive, message})
    expect_same(parse_yaml_camera(text, "a.yml").model, wanted);
  EXPECT_THAT(mistake_of(replaced(message, "binning_x: 0", "binning_x: 2")), HasSubstr("without binning"));
  EXPECT_THAT(mistake_of(replaced(message, "x_offset: 0", "x_offset: 8")), HasSubstr("the whole image"));
}

TEST(CameraExchange, SizeFromOutside) {
  std::string text = replaced(replaced(ros_text, "image_width: 640\n", ""), "image_height: 480\n", "");
  EXPECT_THAT(mistake_of(text), HasSubstr("camera.yml: found no key image_width"));
  EXPECT_EQ(parse_yaml_camera(text, "a.yaml", {800, 600}).model.width_px, 800);
}

TEST(CameraExchange, OtherModelsAreRefused) {
  EXPECT_THAT(mistake_of(replaced(ros_text, "plumb_bob", "equidistant")),
              HasSubstr("camera.yml:10: found the distortion model \"equidistant\", expected plumb_bob"));
  EXPECT_THAT(mistake_of(replaced(replaced(ros_text, "cols: 5", "cols: 8"), "0.000000]", "0, 0.1, 0, 0]")),
              HasSubstr("coefficients beyond k1 k2 p1 p2 k3 that are not 0"));
  EXPECT_THAT(mistake_of(ros_text + "fisheye_model: 1\n"), HasSubstr("a fisheye model"));
  EXPECT_EQ(mistake_of(ros_text + "fisheye_model: 0\n"), "none");
  EXPECT_THAT(mistake_of(replaced(ros_text, "580.46715,    0.", "580.46715,    1.5")), HasSubstr("a skew"));
}

TEST(CameraExchange, MistakesNameTheLine) {
  EXPECT_THAT(mistake_of("a: [1, 2\nb: 3"), HasSubstr("a syntax error"));
  EXPECT_THAT(mistake_of(""), HasSubstr("expected a YAML map"));
  EXPECT_THAT(mistake_of(replaced(ros_text, "640", "640.5")), HasSubstr("camera.yml:1: found 640.5"));
  EXPECT_THAT(mistake_of(replaced(ros_text, "315.27153", ".nan")), HasSubstr("camera.yml:7: found \".nan\""));
  EXPECT_THAT(mistake_of(replaced(ros_text, "315.27153,", "")),
              HasSubstr("8 numbers, expected camera_matrix"));
  EXPECT_THAT(mistake_of(replaced(ros_text, "0.134462,", "")), HasSubstr("rows x cols = 5"));
  EXPECT_THAT(mistake_of(ros_text + "image_width: 640\n"), HasSubstr("\"image_width\" again"));
}

TEST(CameraExchange, DivisionMustBeConvertedBefore) {
  CameraModel division = brown;
  division.distortion = Division{-0.2};
  EXPECT_THROW(opencv_camera_text(division), std::invalid_argument);
  EXPECT_THROW(ros_camera_text(division, "a"), std::invalid_argument);
}

TEST(CameraFile, OneCameraOrSeveral) {
  const CalibratedCamera camera{"", brown, from_six_numbers({1, 2, 3, 10, 20, 30})};
  const std::string one = camera_file_text({camera, true});
  const CameraFile read = parse_camera(one, "one.json");
  expect_same(read.camera.model, brown);
  EXPECT_TRUE(read.has_pose);
  EXPECT_TRUE(read.camera.X_WC.isApprox(camera.X_WC, 1e-12));
  CalibratedCamera left = camera, right = camera;
  left.name = "left";
  right.name = "right";
  EXPECT_EQ(parse_camera(camera_file_text({left, true}), "left.json").camera.name, "left");
  const std::string both = cameras_text({left, right});
  EXPECT_EQ(parse_camera(both, "both.json", "right").camera.name, "right");
  EXPECT_THROW(parse_camera(both, "both.json"), ConfigError);
  EXPECT_THROW(parse_camera(both, "both.json", "middle"), ConfigError);
}

TEST(CameraFile, PoseMayBeAbsent) {
  const std::string text =
      R"({"model":"division","width":768,"height":572,"fx":1,"fy":1,"cx":0,"cy":0,"K":0})";
  EXPECT_FALSE(parse_camera(text, "one.json").has_pose);
  EXPECT_EQ(parse_camera("{\"left\": " + text + "}", "one.json").camera.name, "left");
  EXPECT_EQ(camera_file_text(parse_camera(text, "one.json")).find("X_WC"), std::string::npos);
  EXPECT_THROW(parse_cameras("{\"left\": " + text + "}", "cell"), ConfigError);  // a cell wants the pose
  EXPECT_THROW(parse_camera(replaced(text, "\"fx\":1,", ""), "one.json"), ConfigError);
  EXPECT_THROW(parse_camera("[]", "one.json"), ConfigError);
}

}  // namespace
}  // namespace zeropose
