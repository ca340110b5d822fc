// With noise calibrate_views() errs as it says that it does, and no more than anything can: the Cramer-Rao
// bound, here from differences of pixels that the tested code has no part in.
#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <cmath>
#include <cstdlib>

#include "calib/views.h"
#include "views_scene.h"

namespace zeropose {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using test::Random;
using test::ViewsScene;

constexpr double noise_px = 0.1;

// A thousand trials with ZEROPOSE_LONG, else enough to see a wrong factor of 1.3.
int trials() { return std::getenv("ZEROPOSE_LONG") != nullptr ? 1000 : 60; }

VectorXd pixels_of(const ViewsScene& scene, const CameraModel& model, const std::vector<Pose>& X_CB) {
  VectorXd pixels(2 * static_cast<Index>(scene.points.size()));
  for (std::size_t i = 0; i < scene.points.size(); ++i)
    pixels.segment<2>(2 * static_cast<Index>(i)) =
        test::independent_pixel(model, X_CB[scene.points[i].view] * scene.points[i].point.p_W_mm);
  return pixels;
}

// Covariance of the free internals (places in Internals) at best.
MatrixXd cramer_rao(const ViewsScene& scene, const std::vector<int>& places) {
  const Index internals = static_cast<Index>(places.size());
  const Index size = internals + 6 * static_cast<Index>(scene.views.size());
  const auto moved_pixels = [&](Index k, double by) {
    CameraModel model = scene.models[0];
    std::vector<Pose> X_CB = scene.X_WB;
    if (k < internals) {
      Internals numbers = internals_of(model);
      numbers[places[static_cast<std::size_t>(k)]] += by;
      model = with_internals(model, numbers);
    } else {
      Vector6 delta = Vector6::Zero();
      delta[(k - internals) % 6] = by;
      Pose& X = X_CB[static_cast<std::size_t>((k - internals) / 6)];
      X = moved(X, delta);
    }
    return pixels_of(scene, model, X_CB);
  };
  MatrixXd J(2 * static_cast<Index>(scene.points.size()), size);
  for (Index k = 0; k < size; ++k) {
    const bool length = k < internals ? places[static_cast<std::size_t>(k)] < 4 : (k - internals) % 6 < 3;
    const double step = length ? 1e-3 : 1e-5;
    J.col(k) = (moved_pixels(k, step) - moved_pixels(k, -step)) / (2 * step);
  }
  const MatrixXd information = J.transpose() * J / (noise_px * noise_px);
  const VectorXd scale = information.diagonal().cwiseSqrt().cwiseInverse();
  const MatrixXd scaled = scale.asDiagonal() * information * scale.asDiagonal();
  const MatrixXd inverse = scaled.ldlt().solve(MatrixXd::Identity(size, size));
  return (scale.asDiagonal() * inverse * scale.asDiagonal()).topLeftCorner(internals, internals);
}

struct Judged {
  VectorXd mean, squares;    // in units of the bound's sigma
  double honest = 0;         // part of the trials whose own 95 % ellipsoid holds the truth
  double against_bound = 0;  // mean of e^T C^-1 e / size: 1 for an efficient estimate
};

Judged judge(const ViewsScene& scene, const std::vector<int>& places, double quantile_95,
             std::uint64_t seed) {
  const MatrixXd bound = cramer_rao(scene, places);
  const MatrixXd information = bound.inverse();
  const VectorXd sigma = bound.diagonal().cwiseSqrt();
  const Index size = sigma.size();
  Judged judged{VectorXd::Zero(size), VectorXd::Zero(size)};
  Random random(seed);
  for (int trial = 0; trial < trials(); ++trial) {
    ViewsScene noisy = scene;
    test::add_noise(noisy, noise_px, random);
    const ViewsResult result = calibrate_views(noisy.problem());
    EXPECT_EQ(result.status, CalibrationStatus::ok) << result.reason;
    if (result.status != CalibrationStatus::ok) return judged;
    VectorXd error(size);
    for (Index k = 0; k < size; ++k) {
      const int place = places[static_cast<std::size_t>(k)];
      error[k] = internals_of(result.cameras[0].model)[place] - internals_of(scene.models[0])[place];
    }
    const VectorXd relative = error.cwiseQuotient(sigma);
    judged.mean += relative / trials();
    judged.squares += relative.cwiseAbs2() / trials();
    judged.against_bound += error.dot(information * error) / static_cast<double>(size) / trials();
    const MatrixXd& own = result.cameras[0].internals.covariance;
    judged.honest += (error.dot(own.inverse() * error) <= quantile_95 ? 1.0 : 0.0) / trials();
    EXPECT_NEAR(result.sigma_px, noise_px,
                4 * noise_px / std::sqrt(4.0 * static_cast<double>(scene.points.size())) * 1.5);
  }
  return judged;
}

// Four standard deviations of what so many trials scatter by chance.
void expect_honest_and_efficient(const Judged& judged) {
  const double n = trials(), size = static_cast<double>(judged.mean.size());
  for (Index k = 0; k < judged.mean.size(); ++k) {
    EXPECT_NEAR(judged.mean[k], 0, 4 / std::sqrt(n)) << k;
    EXPECT_NEAR(judged.squares[k], 1, 4 * std::sqrt(2 / n)) << k;
  }
  // Binomial: 0.7 % in 1000 trials, 2.8 % in 60.
  const double chance = std::sqrt(0.95 * 0.05 / n);
  EXPECT_NEAR(judged.honest, 0.95, std::max(0.02, 3 * chance));
  EXPECT_LE(std::sqrt(judged.against_bound), 1.05 + (n < 1000 ? 3 / std::sqrt(2 * size * n) : 0.0));
  std::printf("  error/bound %.3f, 95 %% ellipsoids hold %.1f %%\n", std::sqrt(judged.against_bound),
              100 * judged.honest);
}

TEST(ViewsNoise, DivisionErrsAsItSays) {
  Random random(21);
  const ViewsScene scene = test::scene_of({test::camera_with(Division{-0.2})}, {Pose::Identity()},
                                          test::board(7, 35), 6, 30, random);
  expect_honest_and_efficient(judge(scene, {0, 1, 2, 3, 4}, 11.0705, 22));
}

TEST(ViewsNoise, BrownErrsAsItSays) {
  Random random(23);
  ViewsScene scene = test::scene_of({test::camera_with(BrownConrady{-0.2, 0.1, 0, 0, 0})}, {Pose::Identity()},
                                    test::board(7, 35), 6, 30, random);
  scene.cameras[0].fixed = {Parameter::p1, Parameter::p2, Parameter::k3};
  expect_honest_and_efficient(judge(scene, {0, 1, 2, 3, 4, 5}, 12.5916, 24));
}

// Poses of views and of the second camera: their own covariances against their errors.
TEST(ViewsNoise, PosesErrAsTheySay) {
  Random random(25);
  const Pose X_WC2 = from_six_numbers({250, 10, 20, 2, -17, 3});
  const CameraModel model = test::camera_with(Division{-0.2});
  const ViewsScene scene =
      test::scene_of({model, model}, {Pose::Identity(), X_WC2}, test::board(7, 35), 6, 30, random);
  double camera = 0, view = 0;
  for (int trial = 0; trial < trials(); ++trial) {
    ViewsScene noisy = scene;
    test::add_noise(noisy, noise_px, random);
    ViewsProblem problem = noisy.problem();
    problem.sigma_px = noise_px;
    const ViewsResult result = calibrate_views(problem);
    ASSERT_EQ(result.status, CalibrationStatus::ok) << result.reason;
    const Vector6 a = difference(X_WC2, result.cameras[1].X_WC);
    camera += a.dot(result.cameras[1].pose_covariance.ldlt().solve(a)) / 6 / trials();
    const Vector6 b = difference(scene.X_WB[2], result.views[2].X_WB);
    view += b.dot(result.views[2].covariance.ldlt().solve(b)) / 6 / trials();
  }
  // chi^2 with 6 n degrees of freedom, four standard deviations.
  EXPECT_NEAR(camera, 1, 4 * std::sqrt(2 / (6.0 * trials())));
  EXPECT_NEAR(view, 1, 4 * std::sqrt(2 / (6.0 * trials())));
}

// Pixels of different and correlated uncertainty: weighting them is better than not.
TEST(ViewsNoise, CovariancesWeigh) {
  Random random(27);
  const ViewsScene scene = test::scene_of({test::camera_with(Division{-0.2})}, {Pose::Identity()},
                                          test::board(7, 35), 5, 30, random);
  double with = 0, without = 0, squares = 0;
  for (int trial = 0; trial < trials(); ++trial) {
    ViewsScene noisy = scene;
    for (std::size_t i = 0; i < noisy.points.size(); ++i) {
      const double size = i % 2 == 0 ? 0.02 : 0.5, a = test::normal(random), b = test::normal(random);
      noisy.points[i].point.u_px += size * Eigen::Vector2d(a, 0.8 * a + 0.6 * b);
      noisy.points[i].point.covariance_px2 << 1, 0.8, 0.8, 1;
      noisy.points[i].point.covariance_px2 *= size * size;
    }
    ViewsProblem problem = noisy.problem();
    problem.sigma_px = 1;
    const ViewsResult weighted = calibrate_views(problem);
    for (ViewPoint& seen : noisy.points) seen.point.covariance_px2.setIdentity();
    const ViewsResult plain = calibrate_views(noisy.problem());
    ASSERT_EQ(weighted.status, CalibrationStatus::ok) << weighted.reason;
    ASSERT_EQ(plain.status, CalibrationStatus::ok) << plain.reason;
    const double error = weighted.cameras[0].model.fx_px - scene.models[0].fx_px;
    with += error * error;
    without += std::pow(plain.cameras[0].model.fx_px - scene.models[0].fx_px, 2);
    squares += error * error / weighted.cameras[0].internals.covariance(0, 0) / trials();
  }
  EXPECT_LE(std::sqrt(with), 0.2 * std::sqrt(without));
  EXPECT_NEAR(squares, 1, 4 * std::sqrt(2.0 / trials()));
}

}  // namespace
}  // namespace zeropose
