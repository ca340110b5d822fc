// R. Willson's sample data: least squares as published, or better (shared data: data/real/tsai_willson).
#include <gtest/gtest.h>

#include "calib/calibration.h"
#include "tests/support/calibration_data.h"
#include "tests/support/shared_data.h"

namespace zeropose {
namespace {

CalibrationProblem star_problem(const std::vector<CalibrationPoint>& points) {
  CalibrationProblem problem;
  problem.points = points;
  problem.width_px = 576;
  problem.height_px = 384;
  problem.origin_px = Eigen::Vector2d(258, 204);
  problem.refinement = Refinement::joint;
  return problem;
}

TEST(Willson, NonCoplanarJointly) {
  const auto file = test::shared_data("real/tsai_willson/points_noncoplanar.csv");
  if (!file) GTEST_SKIP() << test::data_not_found;
  const auto points = test::calibration_points(*file);
  const CalibrationResult result = calibrate(star_problem(points));
  ASSERT_EQ(result.status, CalibrationStatus::ok) << result.reason;
  EXPECT_LE(result.residual_sum, 2.41);  // the polynomial model's optimum: 2.3998
  const double tz = (result.X_WC.inverse().translation()).z();
  EXPECT_NEAR(tz / (result.model.fy_px * 0.023), 28.578, 0.02);
}

TEST(Willson, CoplanarJointlyWithOneFocalLength) {
  const auto file = test::shared_data("real/tsai_willson/points_coplanar.csv");
  if (!file) GTEST_SKIP() << test::data_not_found;
  const auto points = test::calibration_points(*file);
  CalibrationProblem problem = star_problem(points);
  problem.one_focal = true;
  const CalibrationResult result = calibrate(problem);
  ASSERT_EQ(result.status, CalibrationStatus::ok) << result.reason;
  EXPECT_LE(result.residual_sum, 1.27);  // the polynomial model's optimum: 1.2136
  const double tz = (result.X_WC.inverse().translation()).z();
  EXPECT_NEAR(tz / (result.model.fy_px * 0.023), 24.437, 0.05);
}

}  // namespace
}  // namespace zeropose
