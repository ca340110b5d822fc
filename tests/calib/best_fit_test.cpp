#include "calib/best_fit.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <limits>

#include "tests/support/poses.h"

namespace zeropose {
namespace {

using test::Random;

std::vector<PointPair> pairs_of(const Pose& X_AB, std::span<const Eigen::Vector3d> points_B) {
  std::vector<PointPair> pairs;
  for (const auto& p_B : points_B) pairs.push_back({X_AB * p_B, p_B, 1});
  return pairs;
}

std::vector<Eigen::Vector3d> cloud(Random& random, int n) {
  std::vector<Eigen::Vector3d> points;
  for (int i = 0; i < n; ++i) points.push_back(test::uniform_vector(random, 1000));
  return points;
}

TEST(BestFit, FindsThePoseOfExactPoints) {
  Random random(1);
  for (int trial = 0; trial < 500; ++trial) {
    const Pose X_AB = test::uniform_pose(random, 5000);
    const auto result = best_fit(pairs_of(X_AB, cloud(random, 3 + trial % 10)));
    ASSERT_EQ(result.status, BestFitStatus::ok);
    test::expect_near(result.X_AB, X_AB, 1e-8, 1e-9);
    ASSERT_LT(result.rms_mm, 1e-9);
  }
}

TEST(BestFit, OfPlanarPointsIsNoMirrorImage) {
  Random random(2);
  auto points = cloud(random, 6);
  for (auto& p : points) p.z() = 0;
  const Pose X_AB = test::uniform_pose(random, 100);
  test::expect_near(best_fit(pairs_of(X_AB, points)).X_AB, X_AB, 1e-8, 1e-9);
}

// 2000 trials: a standard deviation is known to 1.6 %, a frequency of 95 % to 0.5 %.
TEST(BestFit, ScattersAsItsCovarianceSays) {
  constexpr int trials = 2000;
  constexpr double sigma_mm = 0.2, quantile95_of_6 = 12.592;
  Random random(7);
  const auto points = cloud(random, 12);
  const Pose X_AB = test::uniform_pose(random, 500);
  std::normal_distribution<double> noise(0, sigma_mm);
  int inside = 0;
  double variance = 0;
  for (int trial = 0; trial < trials; ++trial) {
    auto pairs = pairs_of(X_AB, points);
    for (std::size_t i = 0; i < pairs.size(); ++i) {
      pairs[i].weight = i % 2 == 0 ? 1 : 0.25;  // half of them twice as uncertain
      for (int k = 0; k < 3; ++k) pairs[i].p_A_mm(k) += noise(random) / std::sqrt(pairs[i].weight);
    }
    const auto result = best_fit(pairs);
    variance += result.sigma_mm * result.sigma_mm / trials;
    const Vector6 error = difference(X_AB, result.X_AB);
    const Matrix6 known = result.covariance * std::pow(sigma_mm / result.sigma_mm, 2);
    const Vector6 size = known.diagonal().cwiseSqrt(), scaled = error.cwiseQuotient(size);
    const Eigen::MatrixXd unit = size.cwiseInverse().asDiagonal() * known * size.cwiseInverse().asDiagonal();
    if (scaled.dot(unit.llt().solve(scaled)) < quantile95_of_6) ++inside;
  }
  EXPECT_NEAR(std::sqrt(variance), sigma_mm, 0.01 * sigma_mm);
  EXPECT_NEAR(inside, 0.95 * trials, 0.02 * trials);
}

TEST(BestFit, IsStationary) {
  Random random(3);
  auto pairs = pairs_of(test::uniform_pose(random, 100), cloud(random, 8));
  for (auto& pair : pairs) {
    pair.p_A_mm += test::uniform_vector(random, 5);
    pair.weight = test::uniform(random, 0.1, 2);
  }
  const auto result = best_fit(pairs);
  const auto cost = [&pairs](const Pose& X_AB) {
    double sum = 0;
    for (const auto& pair : pairs) sum += pair.weight * (pair.p_A_mm - X_AB * pair.p_B_mm).squaredNorm();
    return sum;
  };
  double weights = 0;
  for (const auto& pair : pairs) weights += pair.weight;
  EXPECT_NEAR(result.rms_mm, std::sqrt(cost(result.X_AB) / weights), 1e-12);
  for (int axis = 0; axis < 6; ++axis)
    for (const double sign : {-1.0, 1.0}) {
      Vector6 delta = Vector6::Zero();
      delta(axis) = sign * (axis < 3 ? 1e-3 : 1e-6);
      EXPECT_GT(cost(moved(result.X_AB, delta)), cost(result.X_AB));
    }
}

TEST(BestFit, OfSwappedFramesIsTheInverse) {
  Random random(4);
  auto pairs = pairs_of(test::uniform_pose(random, 100), cloud(random, 8));
  for (auto& pair : pairs) pair.p_A_mm += test::uniform_vector(random, 5);
  auto swapped = pairs;
  for (auto& pair : swapped) std::swap(pair.p_A_mm, pair.p_B_mm);
  test::expect_near(best_fit(swapped).X_AB, best_fit(pairs).X_AB.inverse(), 1e-9, 1e-10);
}

TEST(BestFit, IgnoresPairsOfWeightZero) {
  Random random(5);
  const Pose X_AB = test::uniform_pose(random, 100);
  auto pairs = pairs_of(X_AB, cloud(random, 5));
  pairs.push_back({{1e6, 0, 0}, {0, 0, 0}, 0});
  const auto result = best_fit(pairs);
  test::expect_near(result.X_AB, X_AB, 1e-8, 1e-9);
  EXPECT_GT(result.residuals_mm.back().norm(), 1e5);
}

TEST(BestFit, RefusesTooFewPoints) {
  Random random(6);
  auto pairs = pairs_of(Pose::Identity(), cloud(random, 3));
  pairs.back().weight = 0;
  EXPECT_EQ(best_fit(pairs).status, BestFitStatus::too_few_points);
  EXPECT_EQ(best_fit({}).status, BestFitStatus::too_few_points);
}

TEST(BestFit, RefusesPointsOnALine) {
  std::vector<PointPair> pairs;
  for (int i = 0; i < 6; ++i)
    pairs.push_back({Eigen::Vector3d(i, 2 * i, 3 * i), Eigen::Vector3d(i, 2 * i, 3 * i), 1});
  EXPECT_EQ(best_fit(pairs).status, BestFitStatus::collinear);
  pairs.assign(4, {});
  EXPECT_EQ(best_fit(pairs).status, BestFitStatus::collinear);  // all in one point
}

TEST(BestFit, RefusesNumbersThatAreNone) {
  Random random(7);
  for (const double bad :
       {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()}) {
    auto pairs = pairs_of(Pose::Identity(), cloud(random, 5));
    pairs[2].p_A_mm.y() = bad;
    EXPECT_EQ(best_fit(pairs).status, BestFitStatus::not_finite);
    pairs = pairs_of(Pose::Identity(), cloud(random, 5));
    pairs[2].weight = bad;
    EXPECT_EQ(best_fit(pairs).status, BestFitStatus::not_finite);
  }
  auto pairs = pairs_of(Pose::Identity(), cloud(random, 5));
  pairs[0].weight = -1;
  EXPECT_EQ(best_fit(pairs).status, BestFitStatus::not_finite);
}

}  // namespace
}  // namespace zeropose
