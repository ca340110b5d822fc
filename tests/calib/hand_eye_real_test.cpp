// calibrate_hand_eye() on published data (../shared/data/real/rct_charuco_handeye/README.md): a board on a
// robot's wrist before a camera that stands still, with the results of peers.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <iostream>

#include "calib/hand_eye.h"
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
  const Eigen::Vector3d scatter = scatter_of(views, result);
  std::cout << "X_RC " << result.X_FC.translation().transpose() << " X_HB "
            << result.X_GB.translation().transpose() << " rms " << result.rms_px << " px, " << result.rms_mm
            << " mm " << result.rms_deg << " deg; scatter " << scatter.transpose() << " scale "
            << result.scale << " +- " << result.scale_sigma << " robot " << result.robot_sigma_mm << " mm "
            << result.robot_sigma_deg << " deg, px " << result.sigma_px << " sigma "
            << result.covariance_FC.diagonal().cwiseSqrt().transpose() << "\n";
  for (const auto& view : result.views)
    std::cout << view.used << " " << view.error_mm << " " << view.error_deg << "\n";
  // Peer: least squares of the reprojection errors with scipy.
  EXPECT_LT((result.X_FC.translation() - Eigen::Vector3d(-19.168, 1266.209, 287.428)).norm(), 1.5);
  EXPECT_LT(scatter.maxCoeff(), 0.7);
}

}  // namespace
}  // namespace zeropose
