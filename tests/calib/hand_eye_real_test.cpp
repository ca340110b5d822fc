// calibrate_hand_eye() on published data (../shared/data/real/rct_charuco_handeye/README.md): a board on a
// robot's wrist before a camera that stands still, with the results of peers.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "calib/hand_eye_parts.h"
#include "tests/support/csv.h"
#include "tests/support/poses.h"
#include "tests/support/shared_data.h"

namespace zeropose {
namespace {

using test::CsvTable;

const CameraModel peers_camera{1600,
                               1200,
                               1361.257,
                               1361.799,
                               776.826,
                               621.349,
                               BrownConrady{-0.135413, 0.243775, -0.002212, 0.001771, 0}};

std::vector<HandEyeView> views_of(const CsvTable& robot, const CsvTable& points) {
  std::vector<HandEyeView> views;
  for (std::size_t row = 0; row < robot.size(); ++row)
    views.push_back({robot.text(row, "view"), test::pose(robot, row), {}});
  for (std::size_t row = 0; row < points.size(); ++row) {
    CalibrationPoint point;
    point.p_W_mm = {points.number(row, "x_mm"), points.number(row, "y_mm"), points.number(row, "z_mm")};
    point.u_px = {points.number(row, "u_px"), points.number(row, "v_px")};
    for (HandEyeView& view : views)
      if (view.name == points.text(row, "view")) view.points.push_back(point);
  }
  return views;
}

// Root mean square per axis of the board's place on the wrist, view by view, about its mean.
Eigen::Vector3d scatter_of(const std::vector<HandEyeView>& views, const HandEyeResult& result) {
  Eigen::Vector3d mean = Eigen::Vector3d::Zero(), squares = Eigen::Vector3d::Zero();
  std::vector<Eigen::Vector3d> places;
  for (std::size_t v = 0; v < views.size(); ++v)
    places.push_back((views[v].X_RH.inverse() * result.X_FC * result.views[v].X_CB).translation());
  for (const auto& place : places) mean += place / static_cast<double>(places.size());
  for (const auto& place : places) squares += (place - mean).cwiseAbs2() / static_cast<double>(places.size());
  return squares.cwiseSqrt();
}

TEST(HandEyeRealData, BoardOnARobotsWrist) {
  const auto robot = test::shared_data("real/rct_charuco_handeye/robot_base_to_wrist.csv"),
             points = test::shared_data("real/rct_charuco_handeye/points.csv");
  if (!robot || !points) GTEST_SKIP() << test::data_not_found;
  const auto views = views_of(CsvTable(*robot), CsvTable(*points));
  ASSERT_EQ(views.size(), 14u);
  HandEyeProblem problem;
  problem.model = peers_camera;
  problem.setup = HandEyeSetup::eye_to_hand;
  problem.views = views;
  const HandEyeResult result = calibrate_hand_eye(problem);
  ASSERT_EQ(result.status, HandEyeStatus::ok) << result.reason;
  // Peers: the board's place on the wrist scatters by up to 0.66 mm per axis.
  EXPECT_LT(scatter_of(views, result).maxCoeff(), 0.7);
  // OpenCV's PARK, which weighs all views alike; its own scatter leaves its mean open by about 0.2 mm per
  // axis.
  EXPECT_LT((result.X_FC.translation() - Eigen::Vector3d(-18.55, 1265.27, 288.84)).norm(), 1);
  // The peer's reprojection errors alone take the robot for perfect: so weighted, this is the peer's result.
  const Eigen::Vector3d peer(-19.168, 1266.209, 287.428);
  std::vector<hand_eye::SeenView> seen;
  for (std::size_t v = 0; v < views.size(); ++v) {
    HandEyeViewResult ignored;
    seen.push_back(*hand_eye::look(problem, v, std::nullopt, ignored));
  }
  const hand_eye::Refined alone = hand_eye::refine(
      problem.model, problem.setup, seen, {result.X_FC, result.X_GB}, {result.sigma_px, 0, 0}, false);
  ASSERT_TRUE(alone.converged);
  EXPECT_LT((alone.state.X_FC.translation() - peer).norm(), 0.1);
  EXPECT_NEAR(alone.scale, 1.00548, 3e-4);
  EXPECT_THAT(result.warnings, testing::Contains(testing::HasSubstr("% too small")));
}

}  // namespace
}  // namespace zeropose
