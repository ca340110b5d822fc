// With noise the turn of a stage's axes errs as calibrate_views() says, and the cameras with it.
#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <cmath>
#include <cstdlib>

#include "stage_scene.h"

namespace zeropose {
namespace {

using Eigen::VectorXd;
using test::ViewsScene;

constexpr double noise_px = 0.1;

int trials() { return std::getenv("ZEROPOSE_LONG") != nullptr ? 1000 : 200; }

// 0.3 deg about an axis across the motion.
Pose turned() { return from_six_numbers({0, 0, 0, 0.2, -0.2236, 0}); }

// So many deviate from their number by more than this in a thousandth of all cases.
double room(double part) { return 3.3 * std::sqrt(part * (1 - part) / trials()); }

ViewsResult calibrated(const ViewsScene& scene, StageAxes stage, double sigma_px, test::Random& random) {
  ViewsScene noisy = scene;
  test::add_noise(noisy, noise_px, random);
  ViewsProblem problem = noisy.problem();
  problem.stage = stage;
  problem.sigma_px = sigma_px;
  ViewsResult result = calibrate_views(problem);
  EXPECT_EQ(result.status, CalibrationStatus::ok) << result.reason;
  return result;
}

// e^T C^-1 e over the trials.
class ChiSquare {
 public:
  explicit ChiSquare(double quantile_95) : quantile_95_(quantile_95) {}
  void add(const VectorXd& error, const Eigen::MatrixXd& covariance) {
    const double square = error.dot(covariance.ldlt().solve(error));
    size_ = static_cast<double>(error.size());
    mean_ += square / size_ / trials();
    held_ += (square <= quantile_95_ ? 1.0 : 0.0) / trials();
  }
  void expect_honest(const char* what) const {
    EXPECT_NEAR(mean_, 1, 4 * std::sqrt(2 / (size_ * trials()))) << what;
    EXPECT_NEAR(held_, 0.95, std::max(0.02, room(0.95))) << what;
    std::printf("  %s: error/sigma %.3f, 95 %% ellipsoids hold %.1f %%\n", what, std::sqrt(mean_),
                100 * held_);
  }

 private:
  double quantile_95_, size_ = 0, mean_ = 0, held_ = 0;
};

VectorXd internals_error(const ViewsScene& scene, const ViewsResult& result, std::size_t c) {
  return (internals_of(result.cameras[c].model) - internals_of(scene.models[c])).head<5>();
}

// The turn, both cameras' internals, where the second stands in the sensor and where the last board does.
TEST(StageNoise, ErrsAsItSays) {
  const ViewsScene scene = test::stage_scene(2, turned());
  test::Random random(71);
  ChiSquare turn(5.9915), left(11.0705), right(11.0705), place(12.5916), last(5.9915);
  VectorXd bias = VectorXd::Zero(5);
  const Vector6 truth = difference(Pose::Identity(), turned());
  for (int trial = 0; trial < trials(); ++trial) {
    const ViewsResult result = calibrated(scene, StageAxes::estimate, noise_px, random);
    ASSERT_TRUE(result.stage);
    const Vector6 error = difference(Pose::Identity(), result.stage->X_BS) - truth;
    turn.add(error.segment<2>(3), result.stage->covariance.block<2, 2>(3, 3));
    left.add(internals_error(scene, result, 0), result.cameras[0].internals.covariance);
    right.add(internals_error(scene, result, 1), result.cameras[1].internals.covariance);
    place.add(difference(scene.X_WC[1], result.cameras[1].X_WC), result.cameras[1].pose_covariance);
    last.add(difference(scene.X_WB[6], result.views[6].X_WB).head<2>(),
             result.views[6].covariance.topLeftCorner<2, 2>());
    bias += internals_error(scene, result, 0)
                .cwiseQuotient(result.cameras[0].internals.covariance.diagonal().cwiseSqrt()) /
            trials();
  }
  turn.expect_honest("turn");
  left.expect_honest("internals, left");
  right.expect_honest("internals, right");
  place.expect_honest("X_WC, right");
  last.expect_honest("last board");
  for (int k = 0; k < 5; ++k) EXPECT_NEAR(bias[k], 0, 4 / std::sqrt(trials())) << k;
}

// What the estimate is for: held, focal lengths and origins are off by many of the sigmas that are stated.
TEST(StageNoise, HeldTheCamerasAreWrong) {
  const ViewsScene scene = test::stage_scene(2, turned());
  test::Random random(72);
  VectorXd bias = VectorXd::Zero(5), mean = bias;
  int warned = 0;
  constexpr int few = 20;
  for (int trial = 0; trial < few; ++trial) {
    const ViewsResult result = calibrated(scene, StageAxes::check, noise_px, random);
    const VectorXd error = internals_error(scene, result, 0);
    mean += error / few;
    bias += error.cwiseQuotient(result.cameras[0].internals.covariance.diagonal().cwiseSqrt()) / few;
    for (const std::string& warning : result.diagnosis.warnings)
      warned += warning.find("stage's axes") != std::string::npos ? 1 : 0;
  }
  EXPECT_EQ(warned, few);
  EXPECT_GE(std::abs(bias[0]), 3);
  EXPECT_GE(std::abs(bias[2]), 3);
  std::printf("  held: fx %.2f px (%.1f sigma), fy %.2f (%.1f), cx %.2f (%.1f), cy %.2f (%.1f)\n", mean[0],
              bias[0], mean[1], bias[1], mean[2], bias[2], mean[3], bias[3]);
}

// A parallel board is called turned as seldom as three sigma say, whether the noise is stated or not.
TEST(StageNoise, NoFalseAlarm) {
  const ViewsScene scene = test::stage_scene(2, Pose::Identity());
  test::Random random(73);
  for (const double sigma_px : {noise_px, 0.0}) {
    double alarms = 0, below = 0, quarter = 0;
    for (int trial = 0; trial < trials(); ++trial) {
      const ViewsResult result = calibrated(scene, StageAxes::check, sigma_px, random);
      ASSERT_TRUE(result.stage);
      below += (result.stage->chance < 0.05 ? 1.0 : 0.0) / trials();
      quarter += (result.stage->chance < 0.25 ? 1.0 : 0.0) / trials();
      for (const std::string& warning : result.diagnosis.warnings)
        alarms += warning.find("stage's axes") != std::string::npos ? 1 : 0;
    }
    EXPECT_NEAR(below, 0.05, room(0.05));
    EXPECT_NEAR(quarter, 0.25, room(0.25));
    // Poisson with 0.54 (2.7): more than 4 (9) in a thousandth of all cases.
    EXPECT_LE(alarms, trials() == 1000 ? 9 : 4);
    std::printf("  chance below 5 %% in %.1f %%, below 25 %% in %.1f %%, %g alarms of %d\n", 100 * below,
                100 * quarter, alarms, trials());
  }
}

}  // namespace
}  // namespace zeropose
