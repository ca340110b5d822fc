// Wrong marks (spec 50 M6.3): named and removed where that can be known, refused where not.
#include <gtest/gtest.h>

#include <algorithm>

#include "measure/pose.h"
#include "tests/support/cell_scene.h"

namespace zeropose {
namespace {

using test::CellScene;

Eigen::Vector2d direction(test::Random& random) {
  const double angle = test::uniform(random, 0, 6.283185307);
  return {std::cos(angle), std::sin(angle)};
}

PoseResult estimate(const CellScene& scene, std::span<const Observation> observations) {
  return estimate_pose(test::problem_of(scene.cameras, scene.job, observations, scene.job.X_WO_nominal));
}

TEST(WrongMarks, OneIsNamedAndRemovedWhicheverItIs) {
  const CellScene scene = test::car_body();
  test::Random random(1);
  for (std::size_t wrong = 0; wrong < 12; ++wrong)
    for (const double size_px : {3.0, 20.0, 80.0}) {
      const Pose X_WO = test::random_shift(random, 30, 0.2);
      auto observations = test::observe(scene.cameras, scene.job, X_WO, 0.01, random);
      const PoseResult clean = estimate(scene, observations);
      observations[wrong].u_px += size_px * direction(random);
      const PoseResult result = estimate(scene, observations);
      ASSERT_EQ(result.code, Code::ok) << result.reason;
      EXPECT_EQ(result.removed, std::vector<std::size_t>{wrong});
      EXPECT_TRUE(result.deviations[wrong].removed);
      EXPECT_FALSE(result.deviations[wrong].used);
      EXPECT_NEAR(result.deviations[wrong].dev_px.norm(), size_px, 0.3);
      EXPECT_EQ(result.effective_marks, 11);
      EXPECT_EQ(result.redundancy, 16);
      EXPECT_LT(test::distance_mm(result.X_WO, clean.X_WO), 0.05);
      EXPECT_LT(test::angle_deg(result.X_WO, clean.X_WO), 0.003);
    }
}

TEST(WrongMarks, SeveralAreRemovedWorstFirst) {
  const CellScene scene = test::car_body();
  test::Random random(2);
  for (int trial = 0; trial < 10; ++trial) {
    auto observations =
        test::observe(scene.cameras, scene.job, test::random_shift(random, 30, 0.2), 0.01, random);
    observations[0].u_px += 60 * direction(random);
    observations[4].u_px += 6 * direction(random);
    observations[11].u_px += 25 * direction(random);
    const PoseResult result = estimate(scene, observations);
    ASSERT_EQ(result.code, Code::ok) << result.reason;
    EXPECT_EQ(result.removed, (std::vector<std::size_t>{0, 11, 4}));
  }
}

TEST(WrongMarks, NoneAreSeenWhereThereAreNone) {
  CellScene scene = test::car_body();
  scene.job.system_sigma_px = 0;
  test::Random random(3);
  int alarms = 0;
  for (int trial = 0; trial < 1000; ++trial) {
    const auto observations =
        test::observe(scene.cameras, scene.job, test::random_shift(random, 30, 0.2), 0.05, random);
    const PoseResult result = estimate(scene, observations);
    alarms += result.code != Code::ok || !result.removed.empty();
  }
  EXPECT_LE(alarms, 6);  // 0.1 % by design: one is expected, more than six have a chance of 1e-4
}

TEST(WrongMarks, AreRefusedWhereTheRedundancyCannotTell) {
  const CellScene scene = test::car_body();
  test::Random random(4);
  // Four marks: without any one of them the other three always agree.
  for (std::size_t wrong = 0; wrong < 4; ++wrong) {
    auto observations = test::observe(scene.cameras, scene.job, Pose::Identity(), 0.01, random);
    observations = {observations[0], observations[4], observations[8], observations[10]};
    ASSERT_EQ(estimate(scene, observations).code, Code::ok);
    observations[wrong].u_px += 20 * direction(random);
    const PoseResult result = estimate(scene, observations);
    EXPECT_EQ(result.code, Code::deviation_not_attributable) << result.reason;
    EXPECT_TRUE(result.removed.empty());
    EXPECT_NE(result.reason.find("px"), std::string::npos);
    EXPECT_EQ(result.deviations.size(), 4u);
  }
}

TEST(WrongMarks, OfFiveAreNeverMistaken) {
  const CellScene scene = test::car_body();
  test::Random random(5);
  int named = 0, refused = 0;
  for (int trial = 0; trial < 100; ++trial) {
    auto observations =
        test::observe(scene.cameras, scene.job, test::random_shift(random, 30, 0.2), 0.01, random);
    std::shuffle(observations.begin(), observations.end(), random);
    observations.resize(5);
    if (estimate(scene, observations).code != Code::ok) continue;
    observations[2].u_px += 20 * direction(random);
    const PoseResult result = estimate(scene, observations);
    if (result.code == Code::ok)
      EXPECT_EQ(result.removed, std::vector<std::size_t>{2});
    else
      refused += result.code == Code::deviation_not_attributable;
    named += result.code == Code::ok;
  }
  EXPECT_GT(named, 50);
  EXPECT_GT(named + refused, 80);
}

TEST(WrongMarks, AreRefusedWhenTheyAreTheMajority) {
  const CellScene scene = test::car_body();
  test::Random random(6);
  auto observations = test::observe(scene.cameras, scene.job, Pose::Identity(), 0.01, random);
  for (std::size_t i = 0; i < 12; ++i)
    if (i % 3 != 0) observations[i].u_px += 15 * direction(random);
  EXPECT_EQ(estimate(scene, observations).code, Code::deviation_not_attributable);
}

TEST(WrongMarks, AreThoseAboveTheTolerance) {
  CellScene scene = test::car_body();
  scene.job.system_sigma_px = 2;  // chance would explain it
  test::Random random(7);
  auto observations = test::observe(scene.cameras, scene.job, Pose::Identity(), 0.01, random);
  observations[7].u_px.x() += 3;
  for (Mark& mark : scene.job.marks) mark.tolerance_px = no_tolerance;
  EXPECT_TRUE(estimate(scene, observations).removed.empty());
  scene.job.system_sigma_px = 0.1;
  for (Mark& mark : scene.job.marks) mark.tolerance_px = no_tolerance;
  for (Mark& mark : scene.job.marks) mark.tolerance_mm = 1;
  EXPECT_EQ(estimate(scene, observations).removed, std::vector<std::size_t>{7});
}

TEST(WrongMarks, AreKeptWhenNotAskedFor) {
  const CellScene scene = test::car_body();
  test::Random random(8);
  auto observations = test::observe(scene.cameras, scene.job, Pose::Identity(), 0.01, random);
  observations[1].u_px.y() -= 20;
  PoseProblem problem = test::problem_of(scene.cameras, scene.job, observations, Pose::Identity());
  problem.reject_wrong_marks = false;
  const PoseResult result = estimate_pose(problem);
  EXPECT_EQ(result.code, Code::ok);
  EXPECT_EQ(result.effective_marks, 12);
  EXPECT_GT(result.deviations[1].normalised, 10);
}

}  // namespace
}  // namespace zeropose
