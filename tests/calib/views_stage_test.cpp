// A board whose stage does not move it in its own axes.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "calib/views_stage.h"
#include "stage_scene.h"

namespace zeropose {
namespace {

using Status = CalibrationStatus;
using test::stage_scene;
using test::stage_steps;
using test::ViewsScene;
using testing::Contains;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;

constexpr double sigma_px = 0.1;  // stated; the pixels of these scenes are exact

ViewsResult calibrated(const ViewsScene& scene, StageAxes stage) {
  ViewsProblem problem = scene.problem();
  problem.sigma_px = sigma_px;
  problem.stage = stage;
  return calibrate_views(problem);
}

// Ceres stops a thousandth of a sigma away; six digits of what sigmas there are.
void expect_recovered(const ViewsScene& scene, const ViewsResult& result, const Pose& X_BS) {
  ASSERT_EQ(result.status, Status::ok) << result.reason;
  EXPECT_LE(result.rms_px, 1e-6);
  for (std::size_t c = 0; c < scene.models.size(); ++c) {
    EXPECT_NEAR(result.cameras[c].model.fx_px, scene.models[c].fx_px, 1e-4);
    EXPECT_NEAR(result.cameras[c].model.cx_px, scene.models[c].cx_px, 1e-4);
    EXPECT_LE(difference(result.cameras[c].X_WC, scene.X_WC[c]).norm(), 1e-4);
  }
  for (std::size_t v = 0; v < scene.X_WB.size(); ++v)
    EXPECT_LE(difference(result.views[v].X_WB, scene.X_WB[v]).norm(), 1e-5) << v;
  ASSERT_TRUE(result.stage);
  EXPECT_FALSE(result.stage->held);
  EXPECT_EQ(result.stage->unknown, "");
  EXPECT_LE(difference(result.stage->X_BS, X_BS).norm(), 1e-5);
}

std::vector<Pose> steps_in_two_directions() {
  std::vector<Pose> steps = stage_steps();
  for (const double x_mm : {-10.0, 10.0}) steps.push_back(from_six_numbers({x_mm, 0, 12, 0, 0, 0}));
  return steps;
}

std::vector<Pose> steps_with_turns() {
  std::vector<Pose> steps = stage_steps(4);
  for (const double deg : {-20.0, 20.0}) {
    steps.push_back(from_six_numbers({0, 0, 6, deg, 0, 0}));
    steps.push_back(from_six_numbers({0, 0, 6, 0, deg, 0}));
  }
  return steps;
}

TEST(Stage, IsFoundWithTheCameras) {
  const Pose X_BS = from_six_numbers({0, 0, 0, 0.2, -0.22, 0});
  for (const std::size_t cameras : {1u, 2u}) {
    const ViewsScene scene = stage_scene(cameras, X_BS);
    const ViewsResult result = calibrated(scene, StageAxes::estimate);
    expect_recovered(scene, result, X_BS);
    EXPECT_THAT(result.diagnosis.warnings, Not(Contains(HasSubstr("stage"))));
  }
}

// One direction: two turns. Two: three. With turns about two axes: the shifts as well.
TEST(Stage, WhatTheMotionsShow) {
  const auto expect = [](const std::vector<Pose>& steps, const Pose& X_BS, int unknowns) {
    const ViewsScene scene = stage_scene(2, X_BS, steps);
    const ViewsResult result = calibrated(scene, StageAxes::estimate);
    expect_recovered(scene, result, X_BS);
    EXPECT_EQ(result.stage->unknowns, unknowns);
  };
  expect(stage_steps(), from_six_numbers({0, 0, 0, 0.3, 0.1, 0}), 2);
  expect(steps_in_two_directions(), from_six_numbers({0, 0, 0, 0.3, 0.1, -0.2}), 3);
  expect(steps_with_turns(), from_six_numbers({0.3, -0.2, 0.1, 0.3, 0.1, -0.2}), 6);
}

TEST(Stage, WhatTheMotionsDoNotShowIsLeftAlone) {
  const ViewsScene scene = stage_scene(2, from_six_numbers({0, 0, 0, 0.3, 0.1, 0}));
  const ViewsResult result = calibrated(scene, StageAxes::estimate);
  ASSERT_EQ(result.status, Status::ok) << result.reason;
  const Vector6 variance = result.stage->covariance.diagonal();
  EXPECT_LE(variance.head<3>().norm(), 1e-20);
  EXPECT_GT(variance[3], 1e-10);
  EXPECT_GT(variance[4], 1e-10);
  EXPECT_LE(variance[5], 1e-20);
  // The first view is what the table says, the last one is not.
  EXPECT_EQ(difference(result.views[0].X_WB, *scene.views[0].X_WB).norm(), 0);
  EXPECT_EQ(result.views[0].covariance.norm(), 0);
  EXPECT_GT(result.views[6].covariance(0, 0), 0);
}

// A table that starts anywhere: the frame is its own.
TEST(Stage, TheFirstViewStandsWhereTheTableSays) {
  const Pose X_BS = from_six_numbers({0, 0, 0, 0.2, -0.22, 0}),
             X_WB1 = from_six_numbers({50, -20, 300, 5, 10, 90});
  ViewsScene scene = stage_scene(2, X_BS);
  for (BoardView& view : scene.views) view.X_WB = X_WB1 * *view.X_WB;
  for (Pose& X_WB : scene.X_WB) X_WB = X_WB1 * X_WB;
  for (Pose& X_WC : scene.X_WC) X_WC = X_WB1 * X_WC;
  expect_recovered(scene, calibrated(scene, StageAxes::estimate), X_BS);
}

// Views by hand between those of the stage: they tell the internals, so that one camera without distortion
// tells the stage's turn, which it does not from the stage's alone.
TEST(Stage, OneCameraWithoutDistortionNeedsMore) {
  const Pose X_BS = from_six_numbers({0, 0, 0, 0.2, -0.22, 0});
  ViewsScene scene = stage_scene(1, X_BS, stage_steps(), Division{0});
  test::Random random(61);
  test::add_noise(scene, sigma_px, random);
  const ViewsResult refused = calibrated(scene, StageAxes::estimate);
  EXPECT_EQ(refused.status, Status::not_determined);
  EXPECT_THAT(refused.reason, HasSubstr("stage's axes are turned against the board's"));
  EXPECT_THAT(refused.reason, HasSubstr("hold the focal lengths"));
  EXPECT_THAT(refused.cameras, IsEmpty());

  // Held, the answer stands, but that it fits badly is said.
  const ViewsResult held = calibrated(scene, StageAxes::check);
  ASSERT_EQ(held.status, Status::ok) << held.reason;
  EXPECT_EQ(held.stage->unknown, refused.reason);
  EXPECT_THAT(held.diagnosis.warnings, Contains(HasSubstr("the points do not tell by how much")));

  ViewsScene focal = scene;
  focal.cameras[0].start = scene.models[0];
  focal.cameras[0].fixed = {Parameter::fx, Parameter::fy};
  EXPECT_EQ(calibrated(focal, StageAxes::estimate).status, Status::ok);

  std::vector<Pose> steps = stage_steps();
  for (const double deg : {-30.0, 30.0}) {
    steps.push_back(from_six_numbers({0, 0, 20, deg, 0, 0}));
    steps.push_back(from_six_numbers({0, 0, 20, 0, deg, 0}));
  }
  ViewsScene tilted = stage_scene(1, X_BS, steps, Division{0});
  for (std::size_t v = 7; v < tilted.views.size(); ++v) tilted.views[v].X_WB.reset();
  expect_recovered(tilted, calibrated(tilted, StageAxes::estimate), X_BS);
}

// Lens exactly free of distortion and held so: the equations are singular, not merely weak.
TEST(Stage, SingularEquationsAreNamedToo) {
  ViewsScene scene = stage_scene(1, Pose::Identity(), stage_steps(), Division{0});
  scene.cameras[0].start = scene.models[0];
  scene.cameras[0].fixed = {Parameter::K};
  const ViewsResult refused = calibrated(scene, StageAxes::estimate);
  EXPECT_EQ(refused.status, Status::not_determined);
  EXPECT_THAT(refused.reason, HasSubstr("stage's axes"));
  const ViewsResult held = calibrated(scene, StageAxes::check);
  EXPECT_EQ(held.status, Status::ok) << held.reason;
  EXPECT_THAT(held.stage->unknown, HasSubstr("stage's axes"));
}

// The check finds what the estimate finds, and says what it would do.
TEST(Stage, HeldItIsChecked) {
  const ViewsScene scene = stage_scene(2, from_six_numbers({0, 0, 0, 0.2, -0.22, 0}));
  const ViewsResult held = calibrated(scene, StageAxes::check),
                    found = calibrated(scene, StageAxes::estimate);
  ASSERT_EQ(held.status, Status::ok) << held.reason;
  EXPECT_TRUE(held.stage->held);
  EXPECT_LE(difference(held.stage->X_BS, found.stage->X_BS).norm(), 1e-6);
  EXPECT_LE((held.stage->covariance - found.stage->covariance).norm(), 1e-3 * found.stage->covariance.norm());
  EXPECT_LE(held.stage->chance, 1e-6);
  EXPECT_GE(held.rms_px, 0.1);
  EXPECT_LE(held.stage->rms_px, 1e-6);
  EXPECT_THAT(held.diagnosis.warnings,
              Contains(HasSubstr("rx 0.200 (sigma 0.008), ry -0.220 (sigma 0.029) deg")));
  // What the answer suffers: the table's poses are held, two focal lengths are wrong by 4 px.
  EXPECT_EQ(difference(held.views[6].X_WB, *scene.views[6].X_WB).norm(), 0);
  EXPECT_GE(std::abs(held.cameras[0].model.fx_px - scene.models[0].fx_px), 2);
  EXPECT_GE(held.stage->answer_moves_sigmas, 5);
}

TEST(Stage, AParallelBoardIsNoNews) {
  const ViewsScene scene = stage_scene(2, Pose::Identity());
  const ViewsResult result = calibrated(scene, StageAxes::check);
  ASSERT_EQ(result.status, Status::ok) << result.reason;
  EXPECT_THAT(result.diagnosis.warnings, Not(Contains(HasSubstr("stage"))));
  EXPECT_GE(result.stage->chance, 0.9);
  EXPECT_LE(result.stage->answer_moves_sigmas, 1e-2);
  // Nor is rounding where no noise is stated.
  const ViewsResult exact = calibrate_views(scene.problem());
  EXPECT_GE(exact.stage->chance, 0.9);
}

TEST(Stage, AWrongTableIsNamed) {
  const ViewsScene scene = stage_scene(2, from_six_numbers({0, 0, 0, 8, 0, 0}));
  for (const StageAxes stage : {StageAxes::check, StageAxes::estimate})
    EXPECT_THAT(calibrated(scene, stage).diagnosis.warnings, Contains(HasSubstr("8.0 deg off")));
}

TEST(Stage, WithoutMotionThereIsNone) {
  ViewsScene scene = stage_scene(2, Pose::Identity());
  for (std::size_t v = 1; v < scene.views.size(); ++v) scene.views[v].X_WB.reset();
  EXPECT_FALSE(calibrated(scene, StageAxes::check).stage);
  const ViewsResult result = calibrated(scene, StageAxes::estimate);
  EXPECT_EQ(result.status, Status::wrong_problem);
  EXPECT_THAT(result.reason, HasSubstr("no two views have known poses that differ"));
}

TEST(Stage, DerivativesAreThoseOfThePose) {
  test::Random random(62);
  bundle::Stage stage;
  stage.X_WB1 = test::uniform_pose(random, 100);
  stage.X_S1S = {test::uniform_pose(random, 50)};
  const Pose X_BS = test::uniform_pose(random, 10), X_WB = stage.X_WB(0, X_BS);
  const Matrix6 J = stage.by_stage(0, X_BS);
  for (int k = 0; k < 6; ++k) {
    const double step = k < 3 ? 1e-3 : 1e-5;
    const Vector6 delta = step * Vector6::Unit(k);
    const Vector6 slope = (difference(X_WB, stage.X_WB(0, moved(X_BS, delta))) -
                           difference(X_WB, stage.X_WB(0, moved(X_BS, -delta)))) /
                          (2 * step);
    EXPECT_LE((J.col(k) - slope).norm(), 1e-6 * (1 + slope.norm())) << k;
  }
}

}  // namespace
}  // namespace zeropose
