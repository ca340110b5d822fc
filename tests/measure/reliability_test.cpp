// The power of the test for wrong marks (spec 50 M6.3): against brute force through the estimate itself.
#include "measure/reliability.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "measure/security.h"
#include "tests/support/cell_scene.h"

namespace zeropose {
namespace {

using test::CellScene;

constexpr double sigma_px = 0.05;

std::vector<Observation> exact_pixels(const CellScene& scene) {
  test::Random random(1);
  auto observations = test::observe(scene.cameras, scene.job, Pose::Identity(), 0, random);
  for (Observation& observation : observations)
    observation.covariance_px2 = sigma_px * sigma_px * Eigen::Matrix2d::Identity();
  return observations;
}

std::vector<Eigen::Vector3d> points_of(const CellScene& scene) {
  std::vector<Eigen::Vector3d> points;
  for (const ApplicationPoint& point : scene.job.application_points) points.push_back(point.p_O_mm);
  return points;
}

PoseProblem problem_of(const CellScene& scene, std::span<const Observation> observations) {
  PoseProblem problem = test::problem_of(scene.cameras, scene.job, observations, Pose::Identity());
  problem.reject_wrong_marks = false;
  return problem;
}

Reliability reliability(const CellScene& scene, std::span<const Observation> observations) {
  const PoseProblem problem = problem_of(scene, observations);
  return reliability_of(problem, estimate_pose(problem), points_of(scene));
}

double largest_shift_mm(const CellScene& scene, const Pose& a, const Pose& b) {
  double largest = 0;
  for (const ApplicationPoint& point : scene.job.application_points)
    largest = std::max(largest, (a * point.p_O_mm - b * point.p_O_mm).norm());
  return largest;
}

// What the worst of 180 directions can do and hide, by moving one pixel and estimating again.
ObservationReliability by_brute_force(const CellScene& scene, std::vector<Observation> observations,
                                      std::size_t wrong) {
  constexpr int directions = 180;
  constexpr double step_px = 0.01;
  const double sure = critical_deviation(observations.size()) + 2.3263478740408408;
  const Pose X_WO = estimate_pose(problem_of(scene, observations)).X_WO;
  const Eigen::Vector2d u_px = observations[wrong].u_px;
  ObservationReliability worst{wrong, 0, 0, 0, 0};
  for (int k = 0; k < directions; ++k) {
    const double angle = 3.14159265358979 * k / directions;
    observations[wrong].u_px = u_px + step_px * Eigen::Vector2d(std::cos(angle), std::sin(angle));
    const PoseResult result = estimate_pose(problem_of(scene, observations));
    const double times = sure / result.deviations[wrong].normalised;
    worst.detectable_px = std::max(worst.detectable_px, times * step_px);
    worst.hidden_mm = std::max(worst.hidden_mm, times * largest_shift_mm(scene, X_WO, result.X_WO));
  }
  return worst;
}

TEST(Reliability, IsWhatMovingAPixelDoes) {
  for (const bool equal : {true, false}) {
    CellScene scene = test::car_body_points();
    if (!equal) {
      scene.job.system_sigma_px = 0.1;
      for (std::size_t i = 0; i < 12; i += 2)
        scene.job.marks[i].weight = 0.5, scene.job.marks[i].sigma_mm = 0.05;
    }
    auto observations = exact_pixels(scene);
    if (!equal) observations[3].covariance_px2 << 0.01, 0.004, 0.004, 0.02;
    const Reliability reckoned = reliability(scene, observations);
    ASSERT_EQ(reckoned.observations.size(), 12u);
    for (std::size_t i = 0; i < 12; ++i) {
      const ObservationReliability tried = by_brute_force(scene, observations, i);
      const ObservationReliability& one = reckoned.observations[i];
      EXPECT_EQ(one.observation, i);
      EXPECT_NEAR(one.detectable_px / tried.detectable_px, 1, 0.003);  // a step of 1 degree misses 0.02 %
      EXPECT_NEAR(one.hidden_mm / tried.hidden_mm, 1, 0.003);
      EXPECT_LE(one.hidden_mm, reckoned.hidden_mm);
    }
    EXPECT_EQ(reckoned.observations[reckoned.worst].hidden_mm, reckoned.hidden_mm);
  }
}

// The traces of all redundancies add up to the equations that are too many.
TEST(Reliability, SharesOutTheRedundancy) {
  const CellScene scene = test::car_body_points();
  double sum = 0;
  for (const ObservationReliability& one : reliability(scene, exact_pixels(scene)).observations)
    sum += 2 * one.redundancy;
  EXPECT_NEAR(sum, 24 - 6, 1e-9);
}

TEST(Reliability, GrowsWithTheNoise) {
  const CellScene scene = test::car_body_points();
  auto observations = exact_pixels(scene);
  const double hidden_mm = reliability(scene, observations).hidden_mm;
  for (Observation& observation : observations) observation.covariance_px2 *= 9;
  EXPECT_NEAR(reliability(scene, observations).hidden_mm, 3 * hidden_mm, 1e-9 * hidden_mm);
}

TEST(Reliability, ErrorsOfThatSizeAreFound) {
  const CellScene scene = test::car_body_points();
  constexpr int trials = 1000;
  test::Random random(2);
  for (const std::size_t wrong : {0u, 7u}) {
    const Reliability reckoned = reliability(scene, exact_pixels(scene));
    const double size_px = reckoned.observations[wrong].detectable_px;
    int found = 0;
    for (int trial = 0; trial < trials; ++trial) {
      auto observations = test::observe(scene.cameras, scene.job, Pose::Identity(), sigma_px, random);
      const double angle = test::uniform(random, 0, 6.283185307);
      observations[wrong].u_px += size_px * Eigen::Vector2d(std::cos(angle), std::sin(angle));
      const PoseResult result =
          estimate_pose(test::problem_of(scene.cameras, scene.job, observations, Pose::Identity()));
      found += result.code != Code::ok || !result.removed.empty();
    }
    EXPECT_GE(found, 978);  // 99 % less four standard deviations
  }
}

TEST(Reliability, KnowsThatNothingChecksThreeMarks) {
  CellScene scene = test::car_body_points();
  auto observations = exact_pixels(scene);
  observations = {observations[0], observations[4], observations[8]};
  const Reliability reckoned = reliability(scene, observations);
  ASSERT_EQ(reckoned.observations.size(), 3u);
  for (const ObservationReliability& one : reckoned.observations) {
    EXPECT_TRUE(std::isinf(one.hidden_mm));
    EXPECT_NEAR(one.redundancy, 0, 1e-6);
  }
}

// A count is no safety rule: with six marks nearly on a line one of them can move a tool by more than a
// centimetre.
TEST(Reliability, SixMarksNearlyOnALineHideMuch) {
  CellScene scene = test::car_body_points();
  scene.job.views.clear();
  scene.job.marks.resize(6);
  scene.cameras.resize(1);
  scene.job.X_WO_nominal = scene.cameras[0].X_WC * Pose(Eigen::Translation3d(0, 0, 3000));
  const double aside_mm[] = {6, -4, 2, -6, 4, -2};
  for (std::size_t i = 0; i < 6; ++i) {
    scene.job.marks[i].p_O_mm = {-200 + 80.0 * static_cast<double>(i), aside_mm[i], -aside_mm[5 - i]};
    scene.job.views.push_back({0, i});
  }
  scene.job.application_points = {{"tool", {0, 500, 0}}};
  test::Random random(3);
  auto observations = test::observe(scene.cameras, scene.job, scene.job.X_WO_nominal, 0.1, random);
  PoseProblem problem = problem_of(scene, observations);
  problem.X_WO_start = scene.job.X_WO_nominal;
  const PoseResult pose = estimate_pose(problem);
  ASSERT_EQ(pose.code, Code::ok) << pose.reason;
  const Reliability reckoned = reliability_of(scene.job, problem, pose);
  EXPECT_GT(reckoned.hidden_mm, 10);
  scene.job.requirements.max_hidden_mm = 5;
  const Verdict verdict = check_power(scene.job, problem, reckoned);
  EXPECT_EQ(verdict.code, Code::hidden_error_too_large);
  EXPECT_NE(verdict.reason.find("tool"), std::string::npos) << verdict.reason;
  EXPECT_NE(verdict.reason.find("mm"), std::string::npos);
}

// Three marks in two cameras: every pixel is checked by the other camera, but nothing says that a mark sits
// wrong.
TEST(Reliability, KnowsThatCamerasDoNotCheckWhereAMarkSits) {
  CellScene scene = test::car_body_points();
  scene.cameras.resize(2);
  scene.job.marks.resize(3);
  scene.job.views.clear();
  const Eigen::Vector3d corners[] = {{0, 0, 0}, {500, 0, 0}, {0, 500, 0}};
  for (std::size_t i = 0; i < 2; ++i) {
    scene.cameras[i].model = {1280, 1024, 2500, 2500, 639.5, 511.5, Division{0}};
    scene.cameras[i].X_WC =
        from_six_numbers({i == 0 ? -700.0 : 700.0, 0, -1500, 0, i == 0 ? 20.0 : -20.0, 0});
    for (std::size_t mark = 0; mark < 3; ++mark) {
      scene.job.marks[mark].p_O_mm = corners[mark];
      scene.job.views.push_back({i, mark});
    }
  }
  auto observations = exact_pixels(scene);
  const Reliability unchecked = reliability(scene, observations);
  ASSERT_EQ(unchecked.marks.size(), 3u);
  for (const ObservationReliability& one : unchecked.observations) EXPECT_TRUE(std::isfinite(one.hidden_mm));
  EXPECT_TRUE(unchecked.worst_is_mark);
  EXPECT_GT(unchecked.hidden_mm, 100);
  // With four marks a misplaced one bends what was a plane.
  scene.job.marks.push_back(scene.job.marks[0]);
  scene.job.marks[3].p_O_mm = {500, 500, 100};
  scene.job.views.push_back({0, 3});
  scene.job.views.push_back({1, 3});
  const Reliability checked = reliability(scene, exact_pixels(scene));
  EXPECT_LT(checked.hidden_mm, unchecked.hidden_mm);
}

// Against brute force: a mark is moved, all of its pixels with it, until one deviation is sure to be found.
TEST(Reliability, OfAMarkIsNotBelowWhatMovingItDoes) {
  CellScene scene = test::car_body_points();
  for (std::size_t i = 0; i < 4; ++i) {
    CalibratedCamera second = scene.cameras[i];
    second.X_WC.translation() += 600 * second.X_WC.linear().col(0);
    scene.cameras.push_back(second);
    for (std::size_t mark = 3 * i; mark < 3 * i + 3; ++mark) scene.job.views.push_back({4 + i, mark});
  }
  const auto observations = exact_pixels(scene);
  ASSERT_EQ(observations.size(), 24u);
  const Reliability reckoned = reliability(scene, observations);
  ASSERT_EQ(reckoned.marks.size(), 12u);
  const Pose X_WO = estimate_pose(problem_of(scene, observations)).X_WO;
  const double sure = critical_deviation(24) + 2.3263478740408408;
  test::Random random(4);
  for (int trial = 0; trial < 60; ++trial) {
    const std::size_t mark = static_cast<std::size_t>(trial) % 12;
    CellScene bent = scene;
    bent.job.marks[mark].p_O_mm += 0.1 * test::uniform_vector(random, 1).normalized();
    const auto moved_pixels = exact_pixels(bent);
    const PoseResult result = estimate_pose(problem_of(scene, moved_pixels));
    double shown = 0;
    for (std::size_t i = 0; i < moved_pixels.size(); ++i)
      if (moved_pixels[i].mark == mark) shown = std::max(shown, result.deviations[i].normalised);
    const double hidden_mm = sure / shown * largest_shift_mm(scene, X_WO, result.X_WO);
    EXPECT_LE(hidden_mm, 1.01 * reckoned.marks[mark].hidden_mm);
  }
}

TEST(Reliability, OfASheetCountsItsThreeDirections) {
  CellScene scene = test::car_body_points();
  const auto observations = exact_pixels(scene);
  PoseProblem problem = problem_of(scene, observations);
  problem.X_WP_planar = Pose::Identity();
  double sum = 0;
  for (const ObservationReliability& one :
       reliability_of(problem, estimate_pose(problem), points_of(scene)).observations)
    sum += 2 * one.redundancy;
  EXPECT_NEAR(sum, 24 - 3, 1e-9);
}

TEST(Reliability, IsRefusedOnlyAboveTheLimit) {
  CellScene scene = test::car_body_points();
  const auto observations = exact_pixels(scene);
  const PoseProblem problem = problem_of(scene, observations);
  const Reliability reckoned = reliability_of(scene.job, problem, estimate_pose(problem));
  EXPECT_EQ(check_power(scene.job, problem, reckoned).code, Code::ok);  // no limit, no check
  scene.job.requirements.max_hidden_mm = reckoned.hidden_mm;
  EXPECT_EQ(check_power(scene.job, problem, reckoned).code, Code::ok);
  scene.job.requirements.max_hidden_mm = reckoned.hidden_mm * (1 - 1e-12);
  EXPECT_EQ(check_power(scene.job, problem, reckoned).code, Code::hidden_error_too_large);
}

TEST(Reliability, OfNoPoseIsEmpty) {
  const CellScene scene = test::car_body_points();
  const auto observations = exact_pixels(scene);
  EXPECT_TRUE(reliability_of(problem_of(scene, observations), PoseResult{}, {}).observations.empty());
}

}  // namespace
}  // namespace zeropose
