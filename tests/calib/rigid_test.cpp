#include "calib/rigid.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <vector>

#include "tests/support/poses.h"

namespace zeropose {
namespace {

using test::Random;

constexpr double pi = 3.14159265358979323846;

TEST(SixNumbers, ComposeToTheSamePoseForAnyRotation) {
  Random random(1);
  for (int trial = 0; trial < 20000; ++trial) {
    const Pose X_AB = test::uniform_pose(random, 5000);
    const Pose again = from_six_numbers(to_six_numbers(X_AB));
    ASSERT_LT((again.matrix() - X_AB.matrix()).cwiseAbs().maxCoeff(), 1e-11);
  }
}

TEST(SixNumbers, ComeBackAsWritten) {
  const SixNumbers six{1.5, -2.25, 3, 10, -20, 170};
  test::expect_six_near(to_six_numbers(from_six_numbers(six)), six, 1e-12, 1e-12);
}

TEST(SixNumbers, MultiplyInTheOrderRzRyRx) {
  const Eigen::Matrix3d R = from_six_numbers({0, 0, 0, 90, 0, 90}).linear();
  // Rx(90) carries y to z, and Rz(90) leaves z alone; Rx leaves x alone, and Rz(90) carries x to y.
  EXPECT_LT((R * Eigen::Vector3d::UnitY() - Eigen::Vector3d::UnitZ()).norm(), 1e-15);
  EXPECT_LT((R * Eigen::Vector3d::UnitX() - Eigen::Vector3d::UnitY()).norm(), 1e-15);
}

TEST(SixNumbers, ComposeToTheSameRotationInGimbalLock) {
  for (const double ry : {90.0, -90.0})
    for (const double rx : {-120.0, 0.0, 35.0})
      for (const double rz : {-77.0, 0.0, 150.0}) {
        const Pose X_AB = from_six_numbers({1, 2, 3, rx, ry, rz});
        const SixNumbers six = to_six_numbers(X_AB);
        EXPECT_NEAR(six.ry_deg, ry, 1e-6);
        EXPECT_LT((from_six_numbers(six).matrix() - X_AB.matrix()).cwiseAbs().maxCoeff(), 1e-9);
      }
}

// cos(ry) = 1e-9 is where the extraction changes its formula: above it the two angles come from numbers of
// that size, known to 1e-16, so they are off by 1e-7 rad at most.
TEST(SixNumbers, StayCloseNextToGimbalLock) {
  for (const double away_deg : {1e-3, 1e-5, 1e-7, 1e-9}) {
    const Pose X_AB = from_six_numbers({0, 0, 0, 25, 90 - away_deg, -40});
    const Pose again = from_six_numbers(to_six_numbers(X_AB));
    EXPECT_LT((again.matrix() - X_AB.matrix()).cwiseAbs().maxCoeff(), 1e-7) << away_deg;
  }
}

TEST(ExpLog, AreInverse) {
  Random random(2);
  for (int trial = 0; trial < 20000; ++trial) {
    const Eigen::Matrix3d R = test::uniform_rotation(random);
    const Eigen::Vector3d phi = log_so3(R);
    ASSERT_LE(phi.norm(), pi + 1e-12);
    ASSERT_LT((exp_so3(phi) - R).cwiseAbs().maxCoeff(), 1e-14);
  }
}

TEST(ExpLog, KeepSmallAnglesAndHalfTurns) {
  const Eigen::Vector3d axis = Eigen::Vector3d(1, -2, 2) / 3;
  for (const double angle : {0.0, 1e-15, 1e-9, 1e-5, 0.9e-4, 1.1e-4, 0.01, 1.0, 3.0, pi - 1e-7})
    EXPECT_LT((log_so3(exp_so3(angle * axis)) - angle * axis).norm(), 1e-9 * angle + 1e-16) << angle;
  const Eigen::Matrix3d half_turn = 2 * axis * axis.transpose() - Eigen::Matrix3d::Identity();
  EXPECT_NEAR(std::abs(log_so3(half_turn).dot(axis)), pi, 1e-12);
}

TEST(ExpLog, GiveRotations) {
  Random random(3);
  for (int trial = 0; trial < 1000; ++trial) {
    const Eigen::Matrix3d R = exp_so3(test::uniform_vector(random, 4));
    ASSERT_LT((R * R.transpose() - Eigen::Matrix3d::Identity()).norm(), 1e-14);
    ASSERT_NEAR(R.determinant(), 1, 1e-14);
  }
}

TEST(Moved, IsTheInverseOfDifference) {
  Random random(4);
  for (int trial = 0; trial < 5000; ++trial) {
    const Pose X_AB = test::uniform_pose(random, 3000), X_AB2 = test::uniform_pose(random, 3000);
    test::expect_near(moved(X_AB, difference(X_AB, X_AB2)), X_AB2, 1e-11, 1e-11);
  }
}

TEST(Moved, TurnsAboutTheOriginOfBAlongTheAxesOfA) {
  const Pose X_AB = from_six_numbers({100, 0, 0, 0, 0, 90});
  Vector6 delta;
  delta << 1, 2, 3, 0, 0, pi / 2;
  const Pose X = moved(X_AB, delta);
  EXPECT_LT((X * Eigen::Vector3d::Zero() - Eigen::Vector3d(101, 2, 3)).norm(), 1e-13);
  EXPECT_LT((X.linear() * Eigen::Vector3d::UnitX() + Eigen::Vector3d::UnitX()).norm(), 1e-15);
}

TEST(Average, OfPosesSymmetricAboutAPoseIsThatPose) {
  Random random(5);
  const Pose X_AB = test::uniform_pose(random, 1000);
  std::vector<Pose> poses;
  for (int pair = 0; pair < 20; ++pair) {
    Vector6 delta;
    delta << test::uniform_vector(random, 5), test::uniform_vector(random, 0.4);
    poses.push_back(moved(X_AB, delta));
    poses.push_back(moved(X_AB, -delta));
  }
  test::expect_near(average(poses), X_AB, 1e-11, 1e-11);
}

TEST(Average, LeavesNoMeanDifference) {
  Random random(6);
  std::vector<Pose> poses;
  for (int i = 0; i < 7; ++i) {
    Vector6 delta;
    delta << test::uniform_vector(random, 50), test::uniform_vector(random, 0.5);
    poses.push_back(moved(Pose::Identity(), delta));
  }
  const Pose mean = average(poses);
  Vector6 sum = Vector6::Zero();
  for (const Pose& X_AB : poses) sum += difference(mean, X_AB);
  EXPECT_LT(sum.norm(), 1e-10);
}

std::vector<Pose> scattered(Random& random, int count) {
  const Pose X_AB = test::uniform_pose(random, 1000);
  std::vector<Pose> poses;
  for (int i = 0; i < count; ++i) {
    Vector6 delta;
    delta << test::uniform_vector(random, 50), test::uniform_vector(random, 0.4);
    poses.push_back(moved(X_AB, delta));
  }
  return poses;
}

TEST(Average, OfEqualPosesIsThatPose) {
  Random random(8);
  const Pose X_AB = test::uniform_pose(random, 1000);
  test::expect_near(average(std::vector<Pose>(5, X_AB)), X_AB, 1e-11, 1e-11);
}

TEST(Average, OfTwoIsTheMiddle) {
  Random random(9);
  for (int trial = 0; trial < 100; ++trial) {
    const auto two = scattered(random, 2);
    const Vector6 way = difference(two[0], two[1]);
    test::expect_near(average(two), moved(two[0], 0.5 * way), 1e-10, 1e-10);
  }
}

TEST(Average, GoesWithTheOuterFrame) {
  Random random(10);
  for (int trial = 0; trial < 100; ++trial) {
    auto poses = scattered(random, 6);
    const Pose mean = average(poses), X_GA = test::uniform_pose(random, 2000);
    for (Pose& X_AB : poses) X_AB = X_GA * X_AB;
    test::expect_near(average(poses), X_GA * mean, 1e-9, 1e-9);
  }
}

TEST(Average, DoesNotDependOnTheOrder) {
  Random random(11);
  for (int trial = 0; trial < 100; ++trial) {
    auto poses = scattered(random, 6);
    const Pose mean = average(poses);
    std::shuffle(poses.begin(), poses.end(), random);
    test::expect_near(average(poses), mean, 1e-10, 1e-10);
  }
}

TEST(Average, OfOneIsItself) {
  const std::array<Pose, 1> one{from_six_numbers({1, 2, 3, 40, 50, 60})};
  test::expect_near(average(one), one[0], 1e-14, 1e-12);
}

TEST(NearestRotation, IsTheIdentityOnRotationsAndUndoesNoise) {
  Random random(7);
  for (int trial = 0; trial < 1000; ++trial) {
    const Eigen::Matrix3d R = test::uniform_rotation(random);
    ASSERT_LT((nearest_rotation(R) - R).norm(), 1e-14);
    Eigen::Matrix3d noise;
    for (double& entry : noise.reshaped()) entry = test::normal(random, 1e-3);
    const Eigen::Matrix3d nearest = nearest_rotation(R + noise);
    ASSERT_LE((nearest - (R + noise)).norm(), noise.norm() + 1e-14);  // R itself is a candidate
    ASSERT_NEAR(nearest.determinant(), 1, 1e-13);
  }
}

TEST(NearestRotation, NeverMirrors) {
  EXPECT_NEAR(nearest_rotation(Eigen::Vector3d(1, 1, -0.5).asDiagonal()).determinant(), 1, 1e-14);
}

TEST(CrossMatrix, IsTheCrossProduct) {
  const Eigen::Vector3d v(1, 2, 3), w(-4, 5, 0.5);
  EXPECT_EQ(cross_matrix(v) * w, v.cross(w));
}

}  // namespace
}  // namespace zeropose
