// Marks that carry their number: drawn by OpenCV, pictured through a homography by areas.
#include "measure/coded_marks.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <opencv2/aruco.hpp>
#include <random>

namespace zeropose {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector2d;

constexpr int cells = 8, size_px = 160, fineness = 6;  // cells of a 6 x 6 mark with its border

Vector2d mapped(const Matrix3d& H, const Vector2d& x) { return (H * x.homogeneous()).hnormalized(); }

// Mark (0..8)^2 through H onto white, each pixel from 6 x 6 samples, noise 2 grey levels.
cv::Mat picture_of(int dictionary, int id, const Matrix3d& H) {
  cv::Mat content;
  cv::aruco::drawMarker(cv::aruco::getPredefinedDictionary(dictionary), id, cells, content);
  const Matrix3d back = H.inverse();
  cv::Mat picture(size_px, size_px, CV_8UC1);
  std::mt19937_64 random(1);
  std::normal_distribution<double> normal(0, 2);
  for (int v = 0; v < size_px; ++v) {
    for (int u = 0; u < size_px; ++u) {
      double sum = 0;
      for (int k = 0; k < fineness * fineness; ++k) {
        const Vector2d part(k % fineness + 0.5, k / fineness + 0.5);
        const Vector2d x = mapped(back, Vector2d(u, v) + part / fineness - Vector2d(0.5, 0.5));
        const bool inside = x.minCoeff() >= 0 && x.maxCoeff() < cells;
        const bool white =
            !inside || content.at<std::uint8_t>(static_cast<int>(x.y()), static_cast<int>(x.x())) > 127;
        sum += white ? 200 : 40;
      }
      picture.at<std::uint8_t>(v, u) =
          cv::saturate_cast<std::uint8_t>(sum / (fineness * fineness) + normal(random));
    }
  }
  return picture;
}

ImageView view_of(const cv::Mat& picture) {
  return {picture.data, picture.cols, picture.rows, static_cast<std::ptrdiff_t>(picture.step)};
}

Matrix3d tilted() {
  Matrix3d H;
  H << 9.7, -2.1, 50.3, 2.4, 8.9, 38.6, 0.004, 0.007, 1;
  return H;
}

// Lines through some 60 places of 0.1 px (noise 2 of a rise of 160 over two pixels, and 6 x 6 samples per
// pixel) are good to 0.02 px at their ends: four sigmas.
TEST(CodedMarks, NumberCornersAndCentreOfATiltedMark) {
  for (const auto& [name, dictionary] : {std::pair{"tag36h11", int{cv::aruco::DICT_APRILTAG_36h11}},
                                         std::pair{"6x6_250", int{cv::aruco::DICT_6X6_250}}}) {
    const cv::Mat picture = picture_of(dictionary, 17, tilted());
    const auto marks = coded_marks(view_of(picture), name);
    ASSERT_EQ(marks.size(), 1U) << name;
    EXPECT_EQ(marks[0].id, 17);
    const Vector2d truth[] = {{0, 0}, {cells, 0}, {cells, cells}, {0, cells}};
    for (std::size_t k = 0; k < 4; ++k) {
      EXPECT_LT((marks[0].corners_px[k] - mapped(tilted(), truth[k])).norm(), 0.08)
          << name << " corner " << k;
    }
    EXPECT_LT((marks[0].centre_px - mapped(tilted(), {cells / 2.0, cells / 2.0})).norm(), 0.04) << name;
  }
}

TEST(CodedMarks, NothingWithoutAMarkOrADictionary) {
  const cv::Mat picture = picture_of(cv::aruco::DICT_APRILTAG_36h11, 3, tilted());
  EXPECT_TRUE(coded_marks(view_of(picture), "tag99h99").empty());
  EXPECT_FALSE(is_code_dictionary("tag99h99"));
  EXPECT_TRUE(coded_marks(view_of(picture), "7x7_50").empty());
  EXPECT_TRUE(coded_marks(ImageView{}, "tag36h11").empty());
}

}  // namespace
}  // namespace zeropose
