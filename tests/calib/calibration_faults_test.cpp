// Degenerate inputs are named and never answered with numbers (spec 30).
#include <gtest/gtest.h>

#include <limits>

#include "calib/calibration.h"
#include "tests/support/synthetic_camera.h"

namespace zeropose {
namespace {

using enum CalibrationStatus;
using testing::Test;

struct Input {
  CameraModel camera = test::division_camera(-0.2);
  Pose X_WC = test::looking_at_origin(900, 30, 20);
  std::vector<CalibrationPoint> points;
  CalibrationProblem options;

  explicit Input(const std::vector<Eigen::Vector3d>& body, double sigma_px = 0.05) {
    options.width_px = 768;
    options.height_px = 572;
    options.refinement = Refinement::joint;
    see(body, sigma_px);
  }
  void see(const std::vector<Eigen::Vector3d>& body, double sigma_px = 0.05) {
    std::mt19937_64 random(5);
    points = test::photograph(camera, X_WC, body, sigma_px, random);
  }
  CalibrationResult answer() {
    options.points = points;
    return calibrate(options);
  }
};

void expect_named(const CalibrationResult& result, CalibrationStatus status, const std::string& word) {
  EXPECT_EQ(name_of(result.status), name_of(status)) << result.reason;
  EXPECT_NE(result.reason.find(word), std::string::npos) << result.reason;
  EXPECT_TRUE(result.deviations.empty());
  EXPECT_TRUE(result.uncertainty.parameters.empty());
  EXPECT_EQ(result.model.fx_px, 0);
}

TEST(CalibrationFaults, ABoardParallelToTheChip) {
  for (const double sigma_px : {0.0, 0.1}) {
    Input input(test::grid(7, 1, 40));
    input.X_WC = test::looking_at_origin(900, 0, 15);
    input.see(test::grid(7, 1, 40), sigma_px);
    expect_named(input.answer(), parallel_to_chip, "f / tz");
  }
}

TEST(CalibrationFaults, PointsInAPlaneWhereDepthIsNeeded) {
  Input input(test::grid(6, 1, 50));
  for (const auto method : {CalibrationMethod::noncoplanar, CalibrationMethod::linear}) {
    input.options.method = method;
    expect_named(input.answer(), coplanar, "one plane");
  }
}

TEST(CalibrationFaults, AllButOneInAPlane) {
  auto body = test::grid(6, 1, 50);
  body.emplace_back(20, 30, 80);
  Input input(body);
  input.camera.fy_px = input.camera.fx_px;  // a plane cannot tell them apart
  input.see(body);
  for (const auto method : {CalibrationMethod::noncoplanar, CalibrationMethod::linear}) {
    input.options.method = method;
    expect_named(input.answer(), coplanar, "one plane");
  }
  // The majority decides: as a board it is calibrated, the odd point included.
  input.options.method = CalibrationMethod::automatic;
  const CalibrationResult result = input.answer();
  EXPECT_EQ(result.status, ok) << result.reason;
  EXPECT_TRUE(result.diagnosis.coplanar);
  EXPECT_LT(result.rms_px, 0.15);
}

TEST(CalibrationFaults, DepthWhereAPlaneWasPromised) {
  Input input(test::grid(4, 3, 50));
  input.options.method = CalibrationMethod::coplanar;
  expect_named(input.answer(), wrong_problem, "plane");
}

TEST(CalibrationFaults, OnALine) {
  std::vector<Eigen::Vector3d> line;
  for (int i = 0; i < 12; ++i) line.emplace_back(20.0 * i - 110, 10.0 * i, -5.0 * i);
  expect_named(Input(line).answer(), collinear, "line");
  line.emplace_back(0, 90, 0);  // all but one
  expect_named(Input(line).answer(), collinear, "line");
}

TEST(CalibrationFaults, TooFew) {
  Input none(test::grid(2, 1, 100));
  none.points.clear();
  expect_named(none.answer(), too_few_points, "no points");
  Input three(test::grid(2, 1, 100));
  three.points.pop_back();
  expect_named(three.answer(), too_few_points, "3 different points");
  Input four(test::grid(2, 1, 100));
  expect_named(four.answer(), too_few_points, "5");
  auto five_with_depth = test::grid(2, 2, 100);
  five_with_depth.resize(5);
  five_with_depth.emplace_back(1, 2, 3);
  five_with_depth.pop_back();
  EXPECT_NE(Input(five_with_depth).answer().status, ok);
}

TEST(CalibrationFaults, NothingButRepetitions) {
  Input input(test::grid(2, 1, 100));
  const auto once = input.points;
  for (int i = 0; i < 5; ++i) input.points.insert(input.points.end(), once.begin(), once.begin() + 3);
  input.points.erase(input.points.begin() + 3);
  expect_named(input.answer(), too_few_points, "different");
}

TEST(CalibrationFaults, OnePointAtTwoPlaces) {
  Input input(test::grid(4, 3, 60));
  input.points.push_back(input.points[6]);
  input.points.back().u_px.x() += 40;
  expect_named(input.answer(), duplicate_points, "point 7");
}

TEST(CalibrationFaults, ExactRepetitionsAreSaid) {
  Input input(test::grid(4, 3, 60));
  input.points.push_back(input.points[6]);
  const CalibrationResult result = input.answer();
  ASSERT_EQ(result.status, ok) << result.reason;
  ASSERT_FALSE(result.diagnosis.warnings.empty());
  EXPECT_NE(result.diagnosis.warnings[0].find("repetitions"), std::string::npos);
}

TEST(CalibrationFaults, NumbersThatAreNone) {
  for (const double none :
       {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()}) {
    Input pixel(test::grid(4, 3, 60));
    pixel.points[4].u_px.y() = none;
    expect_named(pixel.answer(), not_finite, "point 5");
    Input point(test::grid(4, 3, 60));
    point.points[0].p_W_mm.x() = none;
    expect_named(point.answer(), not_finite, "point 1");
  }
  Input covariance(test::grid(4, 3, 60));
  covariance.points[2].covariance_px2 = Eigen::Vector2d(1, -1).asDiagonal();
  expect_named(covariance.answer(), not_finite, "covariance");
}

TEST(CalibrationFaults, AllInTheCentre) {
  expect_named(Input(test::grid(4, 3, 2)).answer(), all_in_centre, "image's diagonal");
}

TEST(CalibrationFaults, PointsBehindTheCamera) {
  Input input(test::grid(5, 3, 60));
  // Seen by a mirror: the picture of a point behind the camera, through its centre.
  for (std::size_t i = 0; i < input.points.size(); i += 2) {
    const Eigen::Vector3d arm = input.points[i].p_W_mm - input.X_WC.translation();
    input.points[i].p_W_mm = input.X_WC.translation() - arm;
  }
  EXPECT_NE(input.answer().status, ok);
  Input start(test::grid(5, 3, 60));
  CalibrationStart wrong{start.camera, start.X_WC};
  wrong.X_WC->linear() = start.X_WC.linear() * Eigen::AngleAxisd(3, Eigen::Vector3d::UnitX());
  start.options.start = wrong;
  expect_named(start.answer(), behind_camera, "behind the camera");
}

TEST(CalibrationFaults, AMirrorImage) {
  Input input(test::grid(5, 3, 60));
  for (CalibrationPoint& point : input.points) std::swap(point.u_px.x(), point.u_px.y());
  for (const auto method : {CalibrationMethod::noncoplanar, CalibrationMethod::linear}) {
    input.options.method = method;
    const CalibrationResult result = input.answer();
    EXPECT_NE(result.status, ok) << result.model.fx_px << " rms " << result.rms_px;
  }
}

TEST(CalibrationFaults, UnitsOffByAThousandAreWarnedOf) {
  for (const double scale : {1e-3, 1e3}) {
    Input input(test::grid(5, 3, 70));
    for (CalibrationPoint& point : input.points) point.p_W_mm *= scale;
    const CalibrationResult result = input.answer();
    ASSERT_EQ(result.status, ok) << result.reason;
    std::string all;
    for (const std::string& warning : result.diagnosis.warnings) all += warning;
    EXPECT_NE(all.find("metres"), std::string::npos) << scale << all;
  }
}

TEST(CalibrationFaults, OptionsThatContradictEachOther) {
  Input size(test::grid(5, 3, 60));
  size.options.width_px = 0;
  expect_named(size.answer(), wrong_problem, "image size");
  Input held(test::grid(5, 3, 60));
  held.options.fixed = {Parameter::fx};
  expect_named(held.answer(), wrong_problem, "fx");
  Input pose(test::grid(5, 3, 60));
  pose.options.fixed = pose_parameters;
  expect_named(pose.answer(), wrong_problem, "pose");
  Input lens(test::grid(5, 3, 60));
  lens.options.lens = LensModel::brown;
  lens.options.residual = Residual::algebraic;
  expect_named(lens.answer(), wrong_problem, "algebraic");
  lens.options.residual = Residual::reprojection;
  lens.options.start = CalibrationStart{lens.camera, lens.X_WC};
  expect_named(lens.answer(), wrong_problem, "lens model");
}

TEST(CalibrationFaults, OnePlaneIsToldWithTheSigmaOfItsOrigin) {
  Input input(test::grid(9, 1, 45), 0.02);
  const CalibrationResult result = input.answer();
  ASSERT_EQ(result.status, ok) << result.reason;
  std::string all;
  for (const std::string& warning : result.diagnosis.warnings) all += warning + "\n";
  EXPECT_NE(all.find("fx / fy cannot be determined"), std::string::npos) << all;
  EXPECT_NE(all.find("origin"), std::string::npos) << all;
}

}  // namespace
}  // namespace zeropose
