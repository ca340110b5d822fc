// A frame from measured points: exact by 3-2-1, honest with more, degenerate layouts named.
#include "calib/measured_frame.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <cmath>

#include "tests/support/poses.h"

namespace zeropose {
namespace {

using Eigen::Vector3d;
using test::Random;

std::vector<FramePoint> layout(const Pose& X_TW) {
  return {{"o", FrameRole::origin, X_TW * Vector3d(0, 0, 0)},
          {"x1", FrameRole::x_axis, X_TW * Vector3d(900, 0, 0)},
          {"x2", FrameRole::x_axis, X_TW * Vector3d(2100, 0, 0)},
          {"p1", FrameRole::xy_plane, X_TW * Vector3d(150, 1200, 0)},
          {"p2", FrameRole::xy_plane, X_TW * Vector3d(1800, 1500, 0)},
          {"p3", FrameRole::xy_plane, X_TW * Vector3d(700, -300, 0)}};
}

TEST(MeasuredFrame, IsTheFrameThePointsLieOn) {
  Random random(1);
  for (int k = 0; k < 50; ++k) {
    const Pose X_TW = test::uniform_pose(random, 5000);
    std::vector<FramePoint> points = layout(X_TW);
    const MeasuredFrame more = measured_frame(points, 0.02);
    ASSERT_EQ(more.status, MeasuredFrameStatus::ok) << more.reason;
    test::expect_near(more.X_TW, X_TW, 1e-8, 1e-9);
    EXPECT_EQ(more.redundancy, 3 + 2 * 2 + 3 - 6);
    points = {points[0], points[2], points[3]};
    const MeasuredFrame three = measured_frame(points, 0);
    ASSERT_EQ(three.status, MeasuredFrameStatus::ok) << three.reason;
    test::expect_near(three.X_TW, X_TW, 1e-8, 1e-9);
    EXPECT_EQ(three.redundancy, 0);
    EXPECT_EQ(three.sigma_mm, 0);
  }
}

TEST(MeasuredFrame, CovarianceHoldsTheTruth) {
  Random random(2);
  constexpr double sigma_mm = 0.05;
  constexpr int draws = 2000;
  int inside = 0;
  double variance = 0;
  for (int k = 0; k < draws; ++k) {
    const Pose X_TW = test::uniform_pose(random, 5000);
    std::vector<FramePoint> points = layout(X_TW);
    for (FramePoint& point : points)
      point.p_T_mm += sigma_mm * Vector3d(test::normal(random), test::normal(random), test::normal(random));
    const MeasuredFrame frame = measured_frame(points, sigma_mm);
    ASSERT_EQ(frame.status, MeasuredFrameStatus::ok) << frame.reason;
    const Vector6 off = difference(X_TW, frame.X_TW);
    inside += off.dot(frame.covariance.ldlt().solve(off)) < 12.592 ? 1 : 0;
    variance += std::pow(measured_frame(points, 0).sigma_mm, 2) / draws;
  }
  EXPECT_GT(inside, 0.93 * draws);
  EXPECT_LT(inside, 0.97 * draws);
  // Four degrees of freedom and 2000 draws: the mean variance is known to 1.6 %, five sigmas of that.
  EXPECT_NEAR(variance / (sigma_mm * sigma_mm), 1, 0.08);
}

TEST(MeasuredFrame, SaysWhichPointIsOff) {
  std::vector<FramePoint> points = layout(from_six_numbers({100, 200, 300, 10, 20, 30}));
  const Vector3d z = from_six_numbers({0, 0, 0, 10, 20, 30}).linear().col(2);
  points[4].p_T_mm += 1.0 * z;
  const MeasuredFrame frame = measured_frame(points, 0.02);
  ASSERT_EQ(frame.status, MeasuredFrameStatus::ok);
  // What a role leaves free is no residual.
  EXPECT_EQ(frame.residuals_W_mm[1].x(), 0);
  EXPECT_EQ(frame.residuals_W_mm[4].head<2>(), Eigen::Vector2d::Zero());
  double largest = 0;
  for (const Vector3d& residual : frame.residuals_W_mm) largest = std::max(largest, residual.norm());
  EXPECT_GT(largest, 0.1);
}

TEST(MeasuredFrame, NamesDegenerateLayouts) {
  const std::vector<FramePoint> good = layout(Pose::Identity());
  const auto status_of = [](std::vector<FramePoint> points) { return measured_frame(points, 0).status; };
  EXPECT_EQ(status_of({good[0], good[1]}), MeasuredFrameStatus::too_few_points);
  EXPECT_EQ(status_of({good[1], good[3], good[4]}), MeasuredFrameStatus::too_few_points);
  std::vector<FramePoint> points{good[0], good[1], good[3]};
  points[1].p_T_mm = {0.1, 0, 0};
  EXPECT_EQ(status_of(points), MeasuredFrameStatus::no_direction);
  points = {good[0], good[1], good[3]};
  points[2].p_T_mm = {500, 0.2, 0};
  EXPECT_EQ(status_of(points), MeasuredFrameStatus::no_direction);
  points = good;
  points[1].p_T_mm.x() = -500;
  EXPECT_EQ(status_of(points), MeasuredFrameStatus::wrong_side);
  points[1].p_T_mm.x() = std::nan("");
  EXPECT_EQ(status_of(points), MeasuredFrameStatus::wrong_problem);
}

}  // namespace
}  // namespace zeropose
