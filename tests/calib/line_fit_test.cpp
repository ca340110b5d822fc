// The line of a robot's linear axis from tracker points (spec 50 M7).
#include "calib/line_fit.h"

#include <gtest/gtest.h>

#include <limits>

#include "tests/support/poses.h"

namespace zeropose {
namespace {

using Eigen::Vector3d;
using test::Random;

constexpr double sigma_mm = 0.05;  // of a tracker, per coordinate

struct Axis {
  Vector3d direction = Vector3d(0.6, -0.64, 0.48), p_zero = Vector3d(1200, -2400, 350);

  std::vector<AxisPoint> points(Random& random, int count, double noise_mm) const {
    std::vector<AxisPoint> points;
    for (int i = 0; i < count; ++i) {
      const double e = 250.0 * i - 800;
      const Vector3d noise(test::normal(random, noise_mm), test::normal(random, noise_mm),
                           test::normal(random, noise_mm));
      points.push_back({e, p_zero + e * direction + noise});
    }
    return points;
  }
};

TEST(LineFit, IsExactForPointsOfALine) {
  Random random(1);
  const Axis axis;
  const auto points = axis.points(random, 10, 0);
  const LineFitResult fit = fit_line(points);
  ASSERT_EQ(fit.status, LineFitStatus::ok);
  EXPECT_LT((fit.direction_W - axis.direction).norm(), 1e-12);
  EXPECT_LT((fit.p_zero_W_mm - axis.p_zero).norm(), 1e-8);
  EXPECT_NEAR(fit.scale, 1, 1e-12);
  EXPECT_LT(fit.rms_across_mm, 1e-6);
  for (const Vector3d& residual : fit.residuals_mm) EXPECT_LT(residual.norm(), 1e-8);
}

// Both ends of the axis counted from the other side.
TEST(LineFit, PointsWhereThePositionsGrow) {
  Random random(2);
  auto points = Axis().points(random, 5, 0);
  for (AxisPoint& point : points) point.position_mm = 100 - point.position_mm;
  const LineFitResult fit = fit_line(points);
  EXPECT_LT((fit.direction_W + Axis().direction).norm(), 1e-12);
  EXPECT_LT((fit.p_zero_W_mm - (Axis().p_zero + 100 * Axis().direction)).norm(), 1e-8);
}

// The direction is as good as theory says: sigma / sqrt(sum of squared positions) for each of two angles.
TEST(LineFit, IsAsGoodAsTheNoiseAllows) {
  Random random(3);
  const Axis axis;
  constexpr int trials = 400, count = 10;
  double squares = 0, across = 0, spread = 0;
  for (int i = 0; i < count; ++i) spread += std::pow(250.0 * i - 250.0 * (count - 1) / 2, 2);
  for (int trial = 0; trial < trials; ++trial) {
    const LineFitResult fit = fit_line(axis.points(random, count, sigma_mm));
    squares += (fit.direction_W - axis.direction).squaredNorm() / (2.0 * trials);
    across += fit.rms_across_mm * fit.rms_across_mm / trials;
  }
  // 800 squares of normal numbers: their mean is sure to 5 % (one sigma).
  EXPECT_NEAR(squares / (sigma_mm * sigma_mm / spread), 1, 0.2);
  // Two coordinates across, less the four numbers of the line.
  EXPECT_NEAR(across / (2 * sigma_mm * sigma_mm * (count - 2) / count), 1, 0.1);
}

TEST(LineFit, TellsAWrongGauge) {
  Random random(4);
  auto points = Axis().points(random, 10, 0);
  for (AxisPoint& point : points) point.position_mm /= 1.01;
  EXPECT_NEAR(fit_line(points).scale, 1.01, 1e-12);
}

TEST(LineFit, RefusesWhatIsNoLine) {
  Random random(5);
  auto points = Axis().points(random, 3, 0);
  EXPECT_EQ(fit_line(std::span(points).first(2)).status, LineFitStatus::too_few_points);
  EXPECT_EQ(fit_line({}).status, LineFitStatus::too_few_points);
  auto still = points;
  for (AxisPoint& point : still) point.position_mm = 5;
  EXPECT_EQ(fit_line(still).status, LineFitStatus::no_extent);
  still = points;
  for (AxisPoint& point : still) point.p_W_mm = {1, 2, 3};
  EXPECT_EQ(fit_line(still).status, LineFitStatus::no_extent);
  points[1].p_W_mm.y() = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(fit_line(points).status, LineFitStatus::not_finite);
}

}  // namespace
}  // namespace zeropose
