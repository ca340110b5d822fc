// The robot's tool from touches of a point: recovery, missing turns, wrong touches, honest covariances, wrong
// readings.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/LU>

#include "calib/chance.h"
#include "calib/tool.h"
#include "tests/support/poses.h"

namespace zeropose {
namespace {

using Eigen::Vector3d;
using test::Random;
using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

const Vector3d p_HT(35, -12, 180), p_RT(900, -250, 300);

// The hand at an orientation, with its tool's end on the point.
Pose touch(const Eigen::Matrix3d& R_RH, double sigma_mm, Random& random) {
  Pose X_RH = Pose::Identity();
  X_RH.linear() = R_RH;
  X_RH.translation() = p_RT - R_RH * p_HT;
  for (int k = 0; k < 3; ++k) X_RH.translation()(k) += test::normal(random, sigma_mm);
  return X_RH;
}

std::vector<Pose> touches(std::size_t count, double sigma_mm, Random& random) {
  const Eigen::Matrix3d down = Eigen::AngleAxisd(M_PI, Vector3d::UnitX()).toRotationMatrix();
  std::vector<Pose> X_RH;
  for (std::size_t i = 0; i < count; ++i)
    X_RH.push_back(touch(exp_so3(test::uniform_vector(random, 0.8)) * down, sigma_mm, random));
  return X_RH;
}

ToolResult tool_of(std::span<const Pose> X_RH, double sigma_mm = 0) {
  ToolProblem problem;
  problem.X_RH = X_RH;
  problem.sigma_mm = sigma_mm;
  return calibrate_tool(problem);
}

TEST(Tool, ThreeTouchesAndMoreNoiseFree) {
  Random random(1);
  for (const std::size_t count : {3u, 4u, 9u}) {
    const ToolResult result = tool_of(touches(count, 0, random));
    ASSERT_EQ(result.status, ToolStatus::ok) << result.reason;
    EXPECT_LT((result.p_HT_mm - p_HT).norm(), 1e-8);
    EXPECT_LT((result.p_RT_mm - p_RT).norm(), 1e-8);
    EXPECT_EQ(result.redundancy, static_cast<int>(3 * count) - 6);
    EXPECT_THAT(result.warnings, IsEmpty());
  }
}

TEST(Tool, TurnsAboutOneAxisAreNamed) {
  Random random(2);
  const Vector3d axis_H = Vector3d(1, 2, -2) / 3;
  const Eigen::Matrix3d first = test::uniform_rotation(random);
  std::vector<Pose> X_RH;
  for (const double angle : {0.0, 0.5, 1.1, 2.0, -0.8})
    X_RH.push_back(touch(first * exp_so3(angle * axis_H), 0, random));
  const ToolResult result = tool_of(X_RH);
  EXPECT_EQ(result.status, ToolStatus::rotation_missing);
  EXPECT_NEAR(std::abs(result.turns.axis_H.dot(axis_H)), 1, 1e-9);
  EXPECT_NEAR(std::abs(result.turns.axis_R.dot(first * axis_H)), 1, 1e-9);
  EXPECT_THAT(result.reason, HasSubstr("about one axis only"));
  EXPECT_THAT(result.reason, HasSubstr(direction_text(result.turns.axis_H) + " in the hand"));
  EXPECT_THAT(result.reason, HasSubstr("30 degrees"));
  // One touch that is tilted determines it.
  X_RH.push_back(touch(exp_so3(0.5 * Vector3d::UnitX()) * first, 0, random));
  EXPECT_EQ(tool_of(X_RH).status, ToolStatus::ok);
}

TEST(Tool, TooFewTouchesAndNoTurnAtAll) {
  Random random(3);
  const auto X_RH = touches(2, 0, random);
  EXPECT_EQ(tool_of(X_RH).status, ToolStatus::too_few_touches);
  EXPECT_THAT(tool_of(X_RH).reason, HasSubstr("about one axis only"));
  EXPECT_EQ(tool_of({}).status, ToolStatus::too_few_touches);
  const std::vector<Pose> same(4, X_RH.front());
  EXPECT_EQ(tool_of(same).status, ToolStatus::rotation_missing);
  EXPECT_THAT(tool_of(same).reason, HasSubstr("same orientation"));
  std::vector<Pose> broken = touches(3, 0, random);
  broken[1].translation().x() = std::nan("");
  EXPECT_EQ(tool_of(broken).status, ToolStatus::wrong_problem);
  EXPECT_THAT(tool_of(broken).reason, HasSubstr("touch 2"));
}

TEST(Tool, SmallTurnsAreWarnedOf) {
  Random random(4);
  std::vector<Pose> X_RH;
  for (int i = 0; i < 6; ++i) X_RH.push_back(touch(exp_so3(test::uniform_vector(random, 0.06)), 0, random));
  const ToolResult result = tool_of(X_RH);
  EXPECT_EQ(result.status, ToolStatus::ok) << result.reason;
  EXPECT_THAT(result.warnings, Contains(HasSubstr("turns little")));
}

TEST(Tool, AWrongTouchIsNamedOrNobodyGuesses) {
  Random random(5);
  for (int trial = 0; trial < 20; ++trial) {
    auto X_RH = touches(7, 0.05, random);
    X_RH[4].translation() += 3 * test::uniform_vector(random, 1).normalized();
    const ToolResult result = tool_of(X_RH);
    if (result.status == ToolStatus::ok) {
      EXPECT_THAT(result.removed, ElementsAre(4u));
      EXPECT_LT((result.p_HT_mm - p_HT).norm(), 0.4);
    } else {
      EXPECT_EQ(result.status, ToolStatus::contradiction);
      EXPECT_THAT(result.suspects, Contains(4u));
    }
  }
  // With three touches nobody can know; with the noise given it is seen that they contradict each other.
  auto X_RH = touches(3, 0.05, random);
  X_RH[1].translation() += Vector3d(2, -3, 2);
  EXPECT_EQ(tool_of(X_RH, 0.05).status, ToolStatus::contradiction);
  EXPECT_THAT(tool_of(X_RH, 0.05).removed, IsEmpty());
}

TEST(Tool, ATouchThatAloneGivesTheTurnIsNotCleared) {
  Random random(6);
  std::vector<Pose> X_RH;
  for (const double angle : {0.0, 0.7, 1.4, 2.1})
    X_RH.push_back(touch(exp_so3(angle * Vector3d::UnitZ()), 0.02, random));
  X_RH.push_back(touch(exp_so3(0.6 * Vector3d::UnitX()), 0.02, random));
  X_RH[4].translation() += Vector3d(4, 4, 0);
  const ToolResult result = tool_of(X_RH, 0.02);
  EXPECT_EQ(result.status, ToolStatus::contradiction);
  EXPECT_THAT(result.suspects, Contains(4u));
}

TEST(Tool, OtherReadingsAreRecognised) {
  Random random(7);
  auto X_RH = touches(8, 0.05, random);
  std::vector<Pose> inverted, metres, radians;
  for (const Pose& X : X_RH) {
    inverted.push_back(X.inverse());
    metres.push_back(X), metres.back().translation() /= 1000;
    SixNumbers six = to_six_numbers(X);
    six.rx_deg /= degrees_per_radian, six.ry_deg /= degrees_per_radian, six.rz_deg /= degrees_per_radian;
    radians.push_back(from_six_numbers(six));
  }
  // They fit as well: tool and fixed point change places.
  EXPECT_THAT(tool_of(inverted).warnings, ElementsAre(HasSubstr("look like X_HR, not X_RH")));
  EXPECT_NE(tool_of(radians).status, ToolStatus::ok);
  EXPECT_THAT(tool_of(radians).reason, HasSubstr("radians"));
  const ToolResult small = tool_of(metres);
  EXPECT_THAT(small.warnings, Contains(HasSubstr("metres")));
}

TEST(Tool, CovarianceIsHonest) {
  Random random(8);
  constexpr double sigma_mm = 0.08, ellipsoid_95 = 7.8147;  // chi-square with three degrees
  constexpr int trials = 2000;
  for (const std::size_t count : {4u, 8u})
    for (const double known : {0.0, sigma_mm}) {
      int inside = 0;
      for (int trial = 0; trial < trials; ++trial) {
        const auto X_RH = touches(count, sigma_mm, random);
        ToolProblem problem;
        problem.X_RH = X_RH;
        problem.sigma_mm = known;
        problem.reject_wrong_touches = false;
        const ToolResult result = calibrate_tool(problem);
        const Vector3d error = result.p_HT_mm - p_HT;
        inside += error.dot(result.covariance.inverse() * error) < ellipsoid_95;
      }
      EXPECT_NEAR(inside, 0.95 * trials, 0.02 * trials) << count << " " << known;
    }
}

TEST(Chance, FishersTailAsInTables) {
  // 5 % points of F (any table of the distribution).
  EXPECT_NEAR(fisher_tail(3.4105, 3, 13), 0.05, 2e-5);
  EXPECT_NEAR(fisher_tail(4.2839, 6, 6), 0.05, 2e-5);
  EXPECT_NEAR(fisher_tail(4.7571, 3, 6), 0.05, 2e-5);
  EXPECT_NEAR(fisher_tail(161.45, 1, 1), 0.05, 2e-5);
  // With two and four degrees it has a closed form; between them it falls in between.
  for (const double x : {0.5, 2.0, 7.0}) {
    EXPECT_LT(fisher_tail(2 * x / 3, 3, 20), fisher_tail(2 * x / 4, 4, 20));
    EXPECT_GT(fisher_tail(2 * x / 3, 3, 20), fisher_tail(x, 2, 20));
  }
  EXPECT_NEAR(few_data_factor(6, 100000), 1, 1e-3);
  EXPECT_NEAR(few_data_factor(6, 6), 6 * 4.2839 / 12.5916, 1e-3);
}

}  // namespace
}  // namespace zeropose
