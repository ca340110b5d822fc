// Best fit with the points' covariances: exact where there is no noise, honest where there is, wrong points
// named; and poses chained with theirs.
#include "calib/frame_fit.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <cmath>
#include <vector>

#include "tests/support/poses.h"

namespace zeropose {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using test::Random;

const std::vector<Vector3d> corners_B{{0, 0, 0},     {400, 30, 0},    {10, 350, 20},
                                      {390, 360, 5}, {200, 180, 250}, {50, 60, 200}};

Matrix3d some_covariance(Random& random, double sigma_mm) {
  const Matrix3d R = test::uniform_rotation(random);
  return R * Vector3d(1, 4, 0.25).asDiagonal() * R.transpose() * sigma_mm * sigma_mm;
}

Vector3d draw(Random& random, const Matrix3d& covariance) {
  return covariance.llt().matrixL() *
         Vector3d(test::normal(random), test::normal(random), test::normal(random));
}

std::vector<MeasuredPair> measured(Random& random, const Pose& X_AB, double sigma_A_mm, double sigma_B_mm) {
  std::vector<MeasuredPair> pairs;
  for (const Vector3d& p_B : corners_B) {
    MeasuredPair pair{X_AB * p_B, p_B, some_covariance(random, sigma_A_mm),
                      some_covariance(random, sigma_B_mm)};
    pair.p_A_mm += draw(random, pair.covariance_A_mm2);
    pair.p_B_mm += draw(random, pair.covariance_B_mm2);
    pairs.push_back(pair);
  }
  return pairs;
}

TEST(FrameFit, CarriesEveryPointOver) {
  Random random(1);
  for (int k = 0; k < 20; ++k) {
    const Pose X_AB = test::uniform_pose(random, 2000);
    std::vector<MeasuredPair> pairs = measured(random, X_AB, 0.01, 0.02);
    for (std::size_t i = 0; i < pairs.size(); ++i)
      pairs[i].p_A_mm = X_AB * corners_B[i], pairs[i].p_B_mm = corners_B[i];
    const FrameFitResult result = fit_frames(pairs);
    ASSERT_EQ(result.status, FrameFitStatus::ok) << result.reason;
    test::expect_near(result.X_AB, X_AB, 1e-8, 1e-8);
    EXPECT_EQ(result.redundancy, 12);
    EXPECT_LT(result.rms_mm, 1e-9);
  }
}

// The 95 % ellipsoid of six numbers holds the truth in 95 % of the cases: 12.592 is that quantile of chi
// square; of 2000 draws 95 % +- 2 % is more than four sigma.
TEST(FrameFit, CovarianceHoldsTheTruth) {
  Random random(2);
  int inside = 0;
  constexpr int draws = 2000;
  for (int k = 0; k < draws; ++k) {
    const Pose X_AB = test::uniform_pose(random, 2000);
    const FrameFitResult result = fit_frames(measured(random, X_AB, 0.03, 0.02));
    if (result.status != FrameFitStatus::ok || !result.removed.empty()) continue;
    const Vector6 off = difference(X_AB, result.X_AB);
    inside += off.dot(result.covariance.ldlt().solve(off)) < 12.592 ? 1 : 0;
  }
  EXPECT_GT(inside, 0.93 * draws);
  EXPECT_LT(inside, 0.97 * draws);
}

TEST(FrameFit, NamesTheWrongPoint) {
  Random random(3);
  for (std::size_t wrong = 0; wrong < corners_B.size(); ++wrong) {
    const Pose X_AB = test::uniform_pose(random, 2000);
    std::vector<MeasuredPair> pairs = measured(random, X_AB, 0.02, 0.02);
    pairs[wrong].p_A_mm += Vector3d(1, -1, 1);
    const FrameFitResult result = fit_frames(pairs);
    ASSERT_EQ(result.status, FrameFitStatus::ok) << result.reason;
    ASSERT_EQ(result.removed, std::vector<std::size_t>{wrong});
    EXPECT_NEAR(result.residuals_mm[wrong].norm(), std::sqrt(3), 0.3);
  }
}

// Three points have a redundancy of three: the contradiction is seen, the wrong one cannot be told.
TEST(FrameFit, ThreePointsDoNotTellWhichIsWrong) {
  Random random(4);
  std::vector<MeasuredPair> pairs = measured(random, Pose::Identity(), 0.01, 0.01);
  pairs.resize(3);
  pairs[1].p_A_mm.x() += 2;
  const FrameFitResult result = fit_frames(pairs);
  EXPECT_EQ(result.status, FrameFitStatus::contradiction);
  EXPECT_NE(result.reason.find("contradict"), std::string::npos) << result.reason;
}

TEST(FrameFit, RefusesWhatSaysNothing) {
  Random random(5);
  std::vector<MeasuredPair> pairs = measured(random, Pose::Identity(), 0.01, 0.01);
  EXPECT_EQ(fit_frames(std::span(pairs).first(2)).status, FrameFitStatus::too_few_points);
  std::vector<MeasuredPair> line = pairs;
  for (std::size_t i = 0; i < line.size(); ++i)
    line[i].p_A_mm = line[i].p_B_mm = Vector3d(1, 2, 3) * double(i) + Vector3d(0, 0, 5);
  EXPECT_EQ(fit_frames(line).status, FrameFitStatus::collinear);
  pairs[2].covariance_A_mm2 = pairs[2].covariance_B_mm2 = Matrix3d::Zero();
  EXPECT_EQ(fit_frames(pairs).status, FrameFitStatus::wrong_problem);
  pairs[2].p_A_mm.z() = std::nan("");
  EXPECT_EQ(fit_frames(pairs).status, FrameFitStatus::wrong_problem);
}

// Against draws: the covariance of the product is that of its factors' noise.
TEST(Chain, CovarianceIsThatOfTheProduct) {
  Random random(6);
  const UncertainPose X_AB{test::uniform_pose(random, 1000), 1e-10 * Matrix6::Identity()};
  Matrix6 root = Matrix6::Zero();
  for (int i = 0; i < 6; ++i)
    for (int k = 0; k <= i; ++k) root(i, k) = 1e-5 * test::normal(random);
  const UncertainPose X_BC{test::uniform_pose(random, 1000), root * root.transpose()};
  const UncertainPose X_AC = chain(X_AB, X_BC);
  EXPECT_EQ(X_AC.X.matrix(), (X_AB.X * X_BC.X).matrix());
  int inside = 0;
  constexpr int draws = 4000;
  for (int k = 0; k < draws; ++k) {
    Vector6 a, b;
    for (int i = 0; i < 6; ++i) a(i) = 1e-5 * test::normal(random), b(i) = test::normal(random);
    const Pose drawn = moved(X_AB.X, a) * moved(X_BC.X, root * b);
    const Vector6 off = difference(X_AC.X, drawn);
    inside += off.dot(X_AC.covariance.ldlt().solve(off)) < 12.592 ? 1 : 0;
  }
  EXPECT_GT(inside, 0.93 * draws);
  EXPECT_LT(inside, 0.97 * draws);
}

}  // namespace
}  // namespace zeropose
