// What plan() promises against what estimates then do.
#include "measure/plan.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/cell_scene.h"

namespace zeropose {
namespace {

using test::CellScene;

constexpr double sigma_px = 0.05;

Plan plan_of(const CellScene& scene) { return plan({scene.cameras, scene.job, sigma_px}); }

TEST(Plan, PromisesTheScatterOfEstimates) {
  const CellScene scene = test::car_body_points();
  const Plan planned = plan_of(scene);
  ASSERT_EQ(planned.verdict.code, Code::ok) << planned.verdict.reason;
  ASSERT_EQ(planned.points.size(), scene.job.application_points.size());
  constexpr int trials = 1500;
  test::Random random(1);
  std::vector<Eigen::Vector3d> squares(planned.points.size(), Eigen::Vector3d::Zero());
  Vector6 pose_squares = Vector6::Zero();
  for (int trial = 0; trial < trials; ++trial) {
    const auto observations = test::observe(scene.cameras, scene.job, Pose::Identity(), sigma_px, random);
    PoseProblem problem = test::problem_of(scene.cameras, scene.job, observations, Pose::Identity());
    problem.reject_wrong_marks = false;
    const Pose X_WO = estimate_pose(problem).X_WO;
    pose_squares += difference(Pose::Identity(), X_WO).cwiseAbs2() / trials;
    for (std::size_t k = 0; k < squares.size(); ++k) {
      const Eigen::Vector3d& p_O = scene.job.application_points[k].p_O_mm;
      squares[k] += (X_WO * p_O - p_O).cwiseAbs2() / trials;
    }
  }
  // A standard deviation from 1500 trials scatters by 1.8 %.
  for (std::size_t k = 0; k < squares.size(); ++k)
    for (int axis = 0; axis < 3; ++axis)
      EXPECT_NEAR(std::sqrt(squares[k](axis)) / planned.points[k].sigma_W_mm(axis), 1, 0.075);
  for (int axis = 0; axis < 6; ++axis)
    EXPECT_NEAR(std::sqrt(pose_squares(axis)) / planned.sigma(axis), 1, 0.075);
  double worst = 0;
  for (const PlannedPoint& point : planned.points) {
    EXPECT_GE(point.sigma_mm, point.sigma_W_mm.maxCoeff());
    EXPECT_LE(point.sigma_mm, point.sigma_W_mm.norm());
    worst = std::max(worst, point.sigma_mm);
  }
  EXPECT_DOUBLE_EQ(worst, planned.sigma_mm);
}

TEST(Plan, OfALostCameraIsThatOfTheOthers) {
  const CellScene scene = test::car_body();
  const Plan planned = plan_of(scene);
  ASSERT_EQ(planned.cameras.size(), 4u);
  for (std::size_t lost = 0; lost < 4; ++lost) {
    CellScene left = scene;
    std::erase_if(left.job.views, [lost](const View& view) { return view.camera == lost; });
    const Plan without = plan_of(left);
    const PlannedLoss& loss = planned.cameras[lost].loss;
    EXPECT_EQ(loss.verdict.code, without.verdict.code);
    EXPECT_DOUBLE_EQ(loss.sigma_mm, without.sigma_mm);
    EXPECT_DOUBLE_EQ(loss.hidden_mm, without.hidden_mm);
    EXPECT_GT(loss.sigma_mm, planned.sigma_mm);
    EXPECT_EQ(planned.cameras[lost].marks, 3);
  }
}

TEST(Plan, SaysWhatTheJobWouldRefuse) {
  CellScene scene = test::car_body();
  scene.job.requirements.min_cameras = 4;
  for (const PlannedCamera& camera : plan_of(scene).cameras)
    EXPECT_EQ(camera.loss.verdict.code, Code::too_few_cameras);
  scene.job.requirements.max_sigma_mm = 0.001;
  const Plan planned = plan_of(scene);
  EXPECT_EQ(planned.verdict.code, Code::sigma_too_large);
  EXPECT_FALSE(planned.points.empty());
  scene.job.requirements.max_sigma_mm = 0.5;
  scene.job.requirements.max_hidden_mm = 0.001;
  EXPECT_EQ(plan_of(scene).verdict.code, Code::hidden_error_too_large);
}

TEST(Plan, KnowsWhichMarksAreInThePicture) {
  CellScene scene = test::car_body();
  const Plan planned = plan_of(scene);
  for (const PlannedView& view : planned.views) {
    EXPECT_TRUE(view.seen);
    EXPECT_GT(view.border_px, 0);
    EXPECT_NEAR(view.border_mm / view.border_px,
                2 * scene.job.marks[view.view.mark].radius_mm / view.diameter_px, 1e-9);
    EXPECT_NEAR(view.detectable_mm / view.reliability.detectable_px, view.border_mm / view.border_px, 1e-9);
  }
  // One aside by more than the field of view, one behind its camera.
  scene.job.marks[0].p_O_mm += scene.cameras[0].X_WC.linear().col(0) * 1000;
  scene.job.marks[3].p_O_mm =
      scene.cameras[1].X_WC.translation() - scene.cameras[1].X_WC.linear().col(2) * 100;
  const Plan moved = plan_of(scene);
  EXPECT_FALSE(moved.views[0].seen);
  EXPECT_LT(moved.views[0].border_px, 0);
  EXPECT_FALSE(moved.views[3].seen);
  EXPECT_EQ(moved.cameras[0].marks, 2);
  EXPECT_EQ(moved.verdict.code, Code::ok) << moved.verdict.reason;
}

TEST(Plan, FindsTheDirectionsThatOneCameraTellsWorst) {
  CellScene scene = test::car_body_points();
  std::erase_if(scene.job.views, [](const View& view) { return view.camera != 0; });
  for (int i = 0; i < 2; ++i) {  // more marks round the three
    scene.job.marks[static_cast<std::size_t>(3 + i)].p_O_mm =
        scene.job.marks[static_cast<std::size_t>(i)].p_O_mm + Eigen::Vector3d(30, 60, 90);
    scene.job.views.push_back({0, static_cast<std::size_t>(3 + i)});
  }
  scene.job.requirements.min_cameras = 1;
  scene.job.requirements.min_marks = 3;
  const Plan planned = plan_of(scene);
  ASSERT_EQ(planned.directions.size(), 6u);
  for (std::size_t i = 1; i < 6; ++i)
    EXPECT_LE(planned.directions[i].sigma_mm, planned.directions[i - 1].sigma_mm);
  // Depth and the two tilts are told worst, shifts across the line of sight best.
  const Eigen::Vector3d axis_W = scene.cameras[0].X_WC.linear().col(2);
  const auto along = [&axis_W](const PlannedDirection& direction) {
    return std::abs(direction.translation_W_mm.normalized().dot(axis_W));
  };
  EXPECT_LT(along(planned.directions[5]), 0.2);
  EXPECT_LT(along(planned.directions[4]), 0.2);
  EXPECT_GT(planned.directions[0].sigma_mm, 3 * planned.directions[4].sigma_mm);
}

TEST(Plan, SaysHowMuchOfThePictureTheMarksSpan) {
  CellScene scene = test::car_body_points();
  const CalibratedCamera& camera = scene.cameras[0];
  std::erase_if(scene.job.views, [](const View& view) { return view.camera != 0; });
  // From a quarter to three quarters of the picture both ways.
  const Eigen::Vector2d corners[] = {{191.5, 142.5}, {575.5, 428.5}, {191.5, 428.5}};
  for (std::size_t i = 0; i < 3; ++i)
    scene.job.marks[i].p_O_mm = camera.X_WC * (3000 * *ray(camera.model, corners[i]));
  EXPECT_NEAR(plan_of(scene).cameras.at(0).covered_share, 0.25, 1e-9);
}

// Five points before the first camera, alternately nearer and farther than 2.5 m by so much.
PlannedRecovery recovery_of(double depth_mm, double noise_px) {
  const CellScene scene = test::car_body_points();
  const CalibratedCamera& camera = scene.cameras[0];
  References references;
  const Eigen::Vector2d pixels[] = {{80, 80}, {690, 90}, {380, 290}, {90, 490}, {680, 480}};
  for (std::size_t i = 0; i < 5; ++i) {
    const double z_mm = 2500 + (i % 2 == 0 ? depth_mm : -depth_mm);
    ReferencePoint& point = references.points.emplace_back();
    point.mark.p_O_mm = camera.X_WC * (z_mm * *ray(camera.model, pixels[i]));
    references.views.push_back({0, i});
  }
  return plan({scene.cameras, scene.job, noise_px, &references}).cameras.at(0).recovery;
}

TEST(Plan, SaysHowWellAMovedCameraIsFoundAgain) {
  const PlannedRecovery deep = recovery_of(400, 0.05), noisy = recovery_of(400, 0.1);
  EXPECT_EQ(deep.points, 5);
  EXPECT_EQ(deep.reason, "");
  EXPECT_NEAR(noisy.sigma_mm / deep.sigma_mm, 2, 1e-6);
  EXPECT_NEAR(noisy.sigma_deg / deep.sigma_deg, 2, 1e-6);
  EXPECT_GT(recovery_of(20, 0.05).sigma_mm, 10 * deep.sigma_mm);  // it is the depth that tells
  EXPECT_EQ(plan_of(test::car_body()).cameras.at(0).recovery.points, 0);
}

}  // namespace
}  // namespace zeropose
