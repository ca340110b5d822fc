// The maker of board pictures itself: against OpenCV's projection and against the light that is missing.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <numbers>
#include <opencv2/calib3d.hpp>

#include "tests/support/board_picture.h"

namespace zeropose {
namespace {

using Eigen::Vector2d;
using test::board_pose;
using test::BoardScene;

constexpr double degree = std::numbers::pi / 180;

TEST(BoardPicture, CentresAreWhereOpenCvProjectsThem) {
  BoardScene scene;
  const BrownConrady lens{-0.28, 0.11, 0.0008, -0.0006, -0.02};
  scene.camera = {768, 572, 900, 895, 377, 290, lens};
  scene.X_CB = board_pose(scene, 300, 35 * degree, 0.9, 0.3);
  const Eigen::AngleAxisd turn(scene.X_CB.linear());
  const Eigen::Vector3d r = turn.angle() * turn.axis(), t = scene.X_CB.translation();
  const CameraModel& c = scene.camera;
  const cv::Matx33d A(c.fx_px, 0, c.cx_px, 0, c.fy_px, c.cy_px, 0, 0, 1);
  const cv::Vec<double, 5> d(lens.k1, lens.k2, lens.p1, lens.p2, lens.k3);
  for (int row = 0; row < scene.rows; ++row) {
    for (int col = 0; col < scene.cols; ++col) {
      const Eigen::Vector3d p = scene.p_B_mm({row, col});
      std::vector<cv::Point2d> seen;
      cv::projectPoints(std::vector<cv::Point3d>{{p.x(), p.y(), p.z()}}, cv::Vec3d(r.x(), r.y(), r.z()),
                        cv::Vec3d(t.x(), t.y(), t.z()), A, d, seen);
      EXPECT_LT((scene.centre_px({row, col}) - Vector2d(seen[0].x, seen[0].y)).norm(), 0.002);
    }
  }
}

TEST(BoardPicture, CentroidOfACircleIsWhereTheTruthSaysItIs) {
  BoardScene scene;
  scene.rows = scene.cols = 3;
  scene.pitch_mm = 40;
  scene.diameter_mm = 16;
  scene.camera = {300, 260, 600, 590, 160, 120, Division{-0.25}};
  scene.X_CB = board_pose(scene, 330, 40 * degree, 0.5, 0.3);
  scene.surroundings = scene.surface;
  const auto picture = paint(scene);
  for (int row = 0; row < 3; ++row) {
    for (int col = 0; col < 3; ++col) {
      const Vector2d seen = scene.seen_px({row, col});
      double area = 0;
      Vector2d first = Vector2d::Zero();
      for (int v = int(seen.y()) - 22; v <= int(seen.y()) + 22; ++v) {
        for (int u = int(seen.x()) - 22; u <= int(seen.x()) + 22; ++u) {
          const double share = scene.surface - picture.grey[std::size_t(v * picture.width_px + u)];
          area += share;
          first += share * Vector2d(u, v);
        }
      }
      // The centroid of a distorted disc is not the centre of its best ellipse; both agree to the second
      // order of the lens across the disc.
      EXPECT_LT((first / area - seen).norm(), 4e-3) << row << ' ' << col;
    }
  }
}

}  // namespace
}  // namespace zeropose
