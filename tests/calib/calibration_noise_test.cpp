// With noise: mean error zero, scatter as the reported covariance says and as small as can be (spec 30).
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <random>

#include "calib/calibration.h"
#include "calib/refine.h"
#include "tests/support/synthetic_camera.h"

namespace zeropose {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;
using Vector11 = Eigen::Matrix<double, 11, 1>;

constexpr double sigma_px = 0.1;
constexpr int trials = 1000;
constexpr int n = 11;

struct Scene {
  CameraModel camera = test::division_camera(-0.2);
  Pose X_WC = test::looking_at_origin(900, 30, 20);
  std::vector<Eigen::Vector3d> body = test::grid(5, 3, 70);
};

// fx fy cx cy K and the pose's delta: estimate minus truth.
Vector11 error_of(const CameraModel& model, const Pose& X_WC, const Scene& truth) {
  Vector11 error;
  error << model.fx_px - truth.camera.fx_px, model.fy_px - truth.camera.fy_px,
      model.cx_px - truth.camera.cx_px, model.cy_px - truth.camera.cy_px,
      std::get<Division>(model.distortion).K - std::get<Division>(truth.camera.distortion).K,
      difference(truth.X_WC, X_WC);
  return error;
}

Scene stepped(const Scene& scene, int parameter, double step) {
  Scene next = scene;
  double* const internals[] = {&next.camera.fx_px, &next.camera.fy_px, &next.camera.cx_px, &next.camera.cy_px,
                               &std::get<Division>(next.camera.distortion).K};
  if (parameter < 5)
    *internals[parameter] += step;
  else
    next.X_WC = moved(scene.X_WC, step * Vector6::Unit(parameter - 5));
  return next;
}

// The Cramer-Rao bound by differences of the independent projection.
MatrixXd bound_of(const Scene& scene) {
  const std::array<double, n> steps{0.1, 0.1, 0.1, 0.1, 1e-4, 0.01, 0.01, 0.01, 1e-5, 1e-5, 1e-5};
  MatrixXd J(2 * static_cast<Eigen::Index>(scene.body.size()), n);
  for (int k = 0; k < n; ++k) {
    const double step = steps[static_cast<std::size_t>(k)];
    const Scene above = stepped(scene, k, step), below = stepped(scene, k, -step);
    for (std::size_t i = 0; i < scene.body.size(); ++i)
      J.block<2, 1>(2 * static_cast<Eigen::Index>(i), k) =
          (test::photograph(above.camera, above.X_WC, scene.body[i]) -
           test::photograph(below.camera, below.X_WC, scene.body[i])) /
          (2 * step);
  }
  const VectorXd size = J.colwise().norm();
  const MatrixXd scaled = J * size.cwiseInverse().asDiagonal();
  const MatrixXd inverse = (scaled.transpose() * scaled).inverse();
  return sigma_px * sigma_px * size.cwiseInverse().asDiagonal() * inverse * size.cwiseInverse().asDiagonal();
}

struct Statistics {
  VectorXd mean = VectorXd::Zero(n);
  MatrixXd scatter = MatrixXd::Zero(n, n);  // about the truth
  int inside = 0;                           // of the 95 % ellipsoid
  double sigma = 0;                         // mean estimate of sigma_px
};

Statistics statistics_of(const Scene& scene, const CalibrationProblem& options) {
  constexpr double quantile95_of_11 = 19.675;
  std::mt19937_64 random(20261122);
  Statistics statistics;
  for (int trial = 0; trial < trials; ++trial) {
    const auto points = test::photograph(scene.camera, scene.X_WC, scene.body, sigma_px, random);
    CalibrationProblem problem = options;
    problem.points = points;
    const CalibrationResult result = calibrate(problem);
    EXPECT_EQ(result.status, CalibrationStatus::ok) << result.reason;
    if (result.uncertainty.parameters.size() != n) continue;
    const Vector11 error = error_of(result.model, result.X_WC, scene);
    statistics.mean += error / trials;
    statistics.scatter += error * error.transpose() / trials;
    statistics.sigma += result.sigma_px / trials;
    const VectorXd size = result.uncertainty.covariance.diagonal().cwiseSqrt();
    const MatrixXd correlation =
        size.cwiseInverse().asDiagonal() * result.uncertainty.covariance * size.cwiseInverse().asDiagonal();
    const VectorXd scaled = error.cwiseQuotient(size);
    if (scaled.dot(correlation.ldlt().solve(scaled)) < quantile95_of_11) ++statistics.inside;
  }
  return statistics;
}

CalibrationProblem options() {
  CalibrationProblem problem;
  problem.width_px = 768;
  problem.height_px = 572;
  problem.refinement = Refinement::joint;
  return problem;
}

// 1000 trials: a frequency of 95 % has a standard deviation of 0.7 %, a standard deviation one of 2.2 %.
TEST(CalibrationNoise, ScatterIsTheCramerRaoBoundAndTheReportedCovariance) {
  const Scene scene;
  const MatrixXd bound = bound_of(scene);
  CalibrationProblem problem = options();
  problem.sigma_px = sigma_px;
  const Statistics found = statistics_of(scene, problem);
  EXPECT_GE(found.inside, 930);
  EXPECT_LE(found.inside, 970);
  // Efficiency over all directions together: trace(scatter / bound) / n is 1 with a standard deviation of
  // sqrt(2 / (11 * 1000)) = 1.3 %.
  const VectorXd size = bound.diagonal().cwiseSqrt();
  const MatrixXd unit = size.cwiseInverse().asDiagonal() * bound * size.cwiseInverse().asDiagonal();
  const MatrixXd scatter =
      size.cwiseInverse().asDiagonal() * found.scatter * size.cwiseInverse().asDiagonal();
  const double efficiency = std::sqrt(unit.ldlt().solve(scatter).trace() / n);
  EXPECT_LE(efficiency, 1.05);
  EXPECT_GE(efficiency, 0.95);
  for (int k = 0; k < n; ++k) {
    EXPECT_LE(std::abs(found.mean(k)), 4 * size(k) / std::sqrt(trials)) << k;
    EXPECT_NEAR(std::sqrt(found.scatter(k, k)) / size(k), 1, 0.09) << k;  // 4 standard deviations
  }
}

TEST(CalibrationNoise, SigmaOfThePixelsFollowsFromTheResiduals) {
  const Scene scene;
  const Statistics found = statistics_of(scene, options());
  EXPECT_NEAR(found.sigma, sigma_px, 0.01 * sigma_px);  // 139 redundant equations, 1000 times
  // Student's distribution is wider than the normal one by little with so much redundancy.
  EXPECT_GE(found.inside, 910);
  EXPECT_LE(found.inside, 970);
}

TEST(CalibrationNoise, ObservationsCountAsTheirCovarianceSays) {
  const Scene scene;
  std::mt19937_64 random(3);
  auto points = test::photograph(scene.camera, scene.X_WC, scene.body, 0, random);
  const auto clean = points;
  // One coordinate of some is worth nothing and wrong, along a slanted direction.
  Eigen::Matrix2d turn;
  turn << 0.8, -0.6, 0.6, 0.8;
  const Eigen::Vector2d along = turn.col(0);
  for (std::size_t i = 0; i < points.size(); i += 4) {
    points[i].u_px += 5 * along;
    points[i].covariance_px2 = turn * Eigen::Vector2d(1e10, 1).asDiagonal() * turn.transpose();
    points[i].covariance_px2(0, 1) = points[i].covariance_px2(1, 0);
  }
  CalibrationProblem problem = options();
  problem.points = points;
  const CalibrationResult result = calibrate(problem);
  ASSERT_EQ(result.status, CalibrationStatus::ok) << result.reason;
  EXPECT_NEAR(result.model.fx_px, scene.camera.fx_px, 1e-3);
  EXPECT_NEAR(result.model.cx_px, scene.camera.cx_px, 1e-3);
}

TEST(CalibrationNoise, WrongPointsAreRejectedAndNamed) {
  const Scene scene;
  std::mt19937_64 random(4);
  auto points = test::photograph(scene.camera, scene.X_WC, scene.body, sigma_px, random);
  const std::vector<std::size_t> wrong{3, 17, 40, 41};
  for (const std::size_t i : wrong) points[i].u_px += Eigen::Vector2d(15, -8);
  CalibrationProblem problem = options();
  problem.points = points;
  problem.reject_px = 0.6;
  const CalibrationResult result = calibrate(problem);
  ASSERT_EQ(result.status, CalibrationStatus::ok) << result.reason;
  for (std::size_t i = 0; i < points.size(); ++i)
    EXPECT_EQ(result.deviations[i].used, std::find(wrong.begin(), wrong.end(), i) == wrong.end()) << i;
  EXPECT_LT(result.rms_px, 1.3 * sigma_px * std::sqrt(2.0));
  EXPECT_EQ(result.steps.front().name, "rejected points");
}

// With a quarter of the points wrong by 2..20 px least squares are off by pixels; the robust loss is not.
TEST(CalibrationNoise, RobustLossBearsWrongPoints) {
  const Scene scene;
  std::mt19937_64 random(5);
  auto points = test::photograph(scene.camera, scene.X_WC, scene.body, sigma_px, random);
  std::uniform_real_distribution<double> off(2, 20), angle(0, 6.28);
  for (std::size_t i = 0; i < points.size(); i += 4) {
    const double size = off(random), direction = angle(random);
    points[i].u_px += size * Eigen::Vector2d(std::cos(direction), std::sin(direction));
  }
  CalibrationProblem problem = options();
  problem.points = points;
  const CalibrationResult plain = calibrate(problem);
  problem.robust = 0.3;
  const CalibrationResult robust = calibrate(problem);
  ASSERT_EQ(plain.status, CalibrationStatus::ok) << plain.reason;
  ASSERT_EQ(robust.status, CalibrationStatus::ok) << robust.reason;
  const VectorXd sigma = bound_of(scene).diagonal().cwiseSqrt();
  EXPECT_GT(std::abs(plain.model.fx_px - scene.camera.fx_px), 10 * sigma(0));
  EXPECT_LT(std::abs(robust.model.fx_px - scene.camera.fx_px), 4 * sigma(0));
  EXPECT_LT(std::abs(robust.model.cx_px - scene.camera.cx_px), 4 * sigma(2));
}

}  // namespace
}  // namespace zeropose
