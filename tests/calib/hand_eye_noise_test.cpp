// The covariances of robot-world / hand-eye hold what they promise when pixels and robot are noisy.
#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <cmath>
#include <cstdlib>

#include "tests/calib/robot_scene.h"

namespace zeropose {
namespace {

using test::Random;
using test::robot_scene;

constexpr double ellipsoid_95 = 12.5916;  // chi-square with six degrees
const test::RobotNoise usual{0.1, 0.05, 0.01};

struct Count {
  int camera = 0, board = 0, trials = 0;
};

Count inside(HandEyeSetup setup, std::size_t count, bool known, int trials, Random& random) {
  const test::RobotScene scene = robot_scene(setup, count, 30, random);
  Count result;
  for (int trial = 0; trial < trials; ++trial) {
    const auto views = scene.views(usual, random);
    HandEyeProblem problem = scene.problem(views);
    problem.reject_wrong_views = false;
    if (known)
      problem.sigma_px = usual.px, problem.robot_sigma_mm = usual.mm, problem.robot_sigma_deg = usual.deg;
    const HandEyeResult found = calibrate_hand_eye(problem);
    if (found.status != HandEyeStatus::ok) {
      ADD_FAILURE() << found.reason;
      return result;
    }
    const Vector6 camera = difference(found.X_FC, scene.X_FC), board = difference(found.X_GB, scene.X_GB);
    ++result.trials;
    result.camera += camera.dot(found.covariance_FC.ldlt().solve(camera)) < ellipsoid_95;
    result.board += board.dot(found.covariance_GB.ldlt().solve(board)) < ellipsoid_95;
  }
  return result;
}

class HandEyeNoise : public testing::TestWithParam<std::tuple<HandEyeSetup, std::size_t, bool>> {};

// ZEROPOSE_LONG: a thousand trials, 93 to 97 %. Else three sigmas of what chance leaves of fewer. Where fewer
// than twelve views tell the robot's noise the ellipsoids are larger than they need be
// (docs/robot-calibration.md has the figures): there only the lower bound holds.
TEST_P(HandEyeNoise, CovariancesAreHonest) {
  const auto [setup, views, known] = GetParam();
  Random random(100 + views);
  const int trials = std::getenv("ZEROPOSE_LONG") ? 1000 : 100;
  const Count count = inside(setup, views, known, trials, random);
  const double tolerance = 3 * std::sqrt(0.95 * 0.05 * trials);  // of a thousand 2.07 %
  EXPECT_GE(count.camera, 0.95 * trials - tolerance);
  EXPECT_GE(count.board, 0.95 * trials - tolerance);
  if (!known && views < 12) return;
  EXPECT_LE(count.camera, 0.95 * trials + tolerance);
  EXPECT_LE(count.board, 0.95 * trials + tolerance);
}

INSTANTIATE_TEST_SUITE_P(Views, HandEyeNoise,
                         testing::Combine(testing::Values(HandEyeSetup::eye_in_hand,
                                                          HandEyeSetup::eye_to_hand),
                                          testing::Values(4u, 6u, 12u), testing::Bool()));

}  // namespace
}  // namespace zeropose
