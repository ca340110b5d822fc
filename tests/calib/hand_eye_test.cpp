// Robot-world / hand-eye: recovery in both setups, turns near 180 degrees, missing turns, what is done wrong
// in practice.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "calib/hand_eye_parts.h"
#include "tests/calib/robot_scene.h"
#include "tests/support/synthetic_camera.h"

namespace zeropose {
namespace {

using Eigen::Vector3d;
using test::expect_near;
using test::Random;
using test::robot_scene;
using test::RobotScene;
using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::UnorderedElementsAre;

constexpr HandEyeSetup setups[] = {HandEyeSetup::eye_in_hand, HandEyeSetup::eye_to_hand};
const test::RobotNoise usual{0.1, 0.05, 0.01};

HandEyeResult solve(const RobotScene& scene, std::span<const HandEyeView> views) {
  return calibrate_hand_eye(scene.problem(views));
}

TEST(HandEye, NoiseFreeInBothSetups) {
  Random random(1);
  for (const HandEyeSetup setup : setups)
    for (const std::size_t count : {3u, 4u, 10u}) {
      const RobotScene scene = robot_scene(setup, count, 30, random);
      const auto views = scene.views({}, random);
      const HandEyeResult result = solve(scene, views);
      ASSERT_EQ(result.status, HandEyeStatus::ok) << result.reason;
      expect_near(result.X_FC, scene.X_FC, 1e-5, 1e-6);
      expect_near(result.X_GB, scene.X_GB, 1e-5, 1e-6);
      EXPECT_LT(result.rms_px, 1e-6);
      EXPECT_NEAR(result.scale, 1, 1e-6);
      EXPECT_THAT(result.warnings, IsEmpty());
    }
}

// The poses of the camera alone: turns of any size.
TEST(HandEye, ClosedFormForTurnsOfHalfACircle) {
  Random random(2);
  for (const double less_deg : {0.0, 1e-6, 1e-3, 30.0})
    for (int trial = 0; trial < 20; ++trial) {
      const hand_eye::State truth{test::uniform_pose(random, 900), test::uniform_pose(random, 100)};
      const Pose first = test::uniform_pose(random, 800);
      std::vector<hand_eye::Loop> loops;
      for (int v = 0; v < 4; ++v) {
        Pose X_FG = first;
        const double angle = v == 0 ? 0 : M_PI - less_deg / degrees_per_radian;
        X_FG.linear() = exp_so3(angle * test::uniform_vector(random, 1).normalized()) * first.linear();
        X_FG.translation() = test::uniform_vector(random, 800);
        loops.push_back({X_FG, truth.X_FC.inverse() * X_FG * truth.X_GB});
      }
      const hand_eye::State found = hand_eye::closed_form(loops);
      expect_near(found.X_FC, truth.X_FC, 1e-6, 1e-7);
      expect_near(found.X_GB, truth.X_GB, 1e-6, 1e-7);
    }
}

TEST(HandEye, DerivativesAreThoseOfDifferences) {
  Random random(3);
  for (const HandEyeSetup setup : setups) {
    const RobotScene scene = robot_scene(setup, 3, 30, random);
    const auto views = scene.views({}, random);
    const auto problem = scene.problem(views);
    HandEyeViewResult ignored;
    const auto seen = hand_eye::look(problem, 1, std::nullopt, ignored);
    ASSERT_TRUE(seen);
    hand_eye::State at{moved(scene.X_FC, 0.02 * Vector6::Ones()), moved(scene.X_GB, -0.03 * Vector6::Ones())};
    const auto terms = hand_eye::pixel_terms(scene.model, setup, at, *seen);
    ASSERT_TRUE(terms);
    const Pose X_CB = hand_eye::predicted(setup, at, seen->X_RH);
    constexpr double step = 1e-5;
    for (int k = 0; k < 12; ++k) {
      const auto shifted = [&](double by) {
        const Vector6 delta = by * Vector6::Unit(k % 6);
        const hand_eye::State there{k < 6 ? moved(at.X_FC, delta) : at.X_FC,
                                    k < 6 ? at.X_GB : moved(at.X_GB, delta)};
        return difference(X_CB, hand_eye::predicted(setup, there, seen->X_RH));
      };
      const Vector6 slope = (shifted(step) - shifted(-step)) / (2 * step);
      EXPECT_LT((slope - terms->by_state.col(k)).norm(), 1e-5 * (1 + slope.norm())) << k;
    }
    for (int k = 0; k < 6; ++k) {
      const auto shifted = [&](double by) {
        return difference(X_CB, hand_eye::predicted(setup, at, moved(seen->X_RH, by * Vector6::Unit(k))));
      };
      const Vector6 slope = (shifted(step) - shifted(-step)) / (2 * step);
      EXPECT_LT((slope - terms->by_robot.col(k)).norm(), 1e-5 * (1 + slope.norm())) << k;
    }
  }
}

// The gradient of half the squared reprojection errors by the twelve unknowns is -J' M e.
TEST(HandEye, StepsFollowTheReprojectionErrors) {
  Random random(4);
  for (const HandEyeSetup setup : setups) {
    const RobotScene scene = robot_scene(setup, 3, 30, random);
    const auto views = scene.views({0.1, 0.05, 0.01}, random);
    const auto problem = scene.problem(views);
    HandEyeViewResult ignored;
    const auto seen = hand_eye::look(problem, 0, std::nullopt, ignored);
    ASSERT_TRUE(seen);
    const hand_eye::State at{scene.X_FC, scene.X_GB};
    const auto terms = hand_eye::pixel_terms(scene.model, setup, at, *seen);
    ASSERT_TRUE(terms);
    const Eigen::Matrix<double, 12, 1> gradient =
        -terms->by_state.transpose() * terms->cofactor.ldlt().solve(terms->e);
    const auto cost = [&](int k, double by) {
      const Vector6 delta = by * Vector6::Unit(k % 6);
      const hand_eye::State there{k < 6 ? moved(at.X_FC, delta) : at.X_FC,
                                  k < 6 ? at.X_GB : moved(at.X_GB, delta)};
      return 0.5 *
             *bundle::cost_of(scene.model, hand_eye::predicted(setup, there, seen->X_RH), seen->points, 0);
    };
    for (int k = 0; k < 12; ++k) {
      const double step = k % 6 < 3 ? 1e-4 : 1e-7;
      const double slope = (cost(k, step) - cost(k, -step)) / (2 * step);
      EXPECT_NEAR(gradient(k), slope, 1e-4 * std::abs(slope) + 1e-5 * gradient.norm()) << k;
    }
  }
}

TEST(HandEye, TurnsAboutOneAxisAreNamed) {
  Random random(5);
  const Vector3d axis_H = Vector3d(2, -1, 2) / 3;
  for (const HandEyeSetup setup : setups) {
    const RobotScene scene = test::scene_with_one_axis(setup, 6, axis_H, random);
    std::vector<HandEyeView> views;
    // Boards that are seen although nothing is in the picture: the poses alone decide.
    RobotScene other = robot_scene(setup, 6, 30, random);
    views = other.views({}, random);
    for (std::size_t v = 0; v < views.size(); ++v) views[v].X_RH = scene.X_RH[v];
    const HandEyeResult result = solve(scene, views);
    EXPECT_EQ(result.status, HandEyeStatus::rotation_missing);
    EXPECT_NEAR(std::abs(result.turns.axis_H.dot(axis_H)), 1, 1e-9);
    EXPECT_THAT(result.reason, HasSubstr("about one axis only"));
    EXPECT_THAT(result.reason, HasSubstr("the camera's place"));
  }
}

TEST(HandEye, TooFewViews) {
  Random random(6);
  const RobotScene scene = robot_scene(HandEyeSetup::eye_in_hand, 4, 30, random);
  auto views = scene.views({}, random);
  EXPECT_EQ(solve(scene, std::span(views).first(2)).status, HandEyeStatus::too_few_views);
  EXPECT_EQ(solve(scene, {}).status, HandEyeStatus::too_few_views);
  views[0].points.resize(2), views[1].points.resize(3);
  const HandEyeResult result = solve(scene, views);
  EXPECT_EQ(result.status, HandEyeStatus::too_few_views);
  EXPECT_THAT(result.reason, HasSubstr("view 1: 2 reference points"));
}

TEST(HandEye, AViewWithoutABoardIsLeftOutAndNamed) {
  Random random(7);
  const RobotScene scene = robot_scene(HandEyeSetup::eye_in_hand, 6, 30, random);
  auto views = scene.views(usual, random);
  views[2].points.resize(3);
  const HandEyeResult result = solve(scene, views);
  ASSERT_EQ(result.status, HandEyeStatus::ok) << result.reason;
  EXPECT_FALSE(result.views[2].used);
  EXPECT_THAT(result.views[2].reason, HasSubstr("3 reference points"));
  EXPECT_TRUE(result.views[3].used);
}

TEST(HandEye, ARobotThatDidNotStandStillIsNamed) {
  Random random(8);
  for (const HandEyeSetup setup : setups)
    for (const std::size_t count : {6u, 10u}) {
      const RobotScene scene = robot_scene(setup, count, 30, random);
      auto views = scene.views(usual, random);
      Vector6 went;
      went << 3, -2, 2, 0.002, 0.004, -0.003;
      views[3].X_RH = moved(views[3].X_RH, went);
      const HandEyeResult result = solve(scene, views);
      ASSERT_EQ(result.status, HandEyeStatus::ok) << result.reason;
      EXPECT_THAT(result.removed, ElementsAre(3u));
      EXPECT_FALSE(result.views[3].used);
      EXPECT_THAT(result.views[3].reason, HasSubstr("contradicts"));
      EXPECT_GT(result.views[3].error_mm, 2);
      EXPECT_LT(test::distance_mm(result.X_FC, scene.X_FC), 1);
    }
}

// Without the only view that is turned about another axis nothing tells whether it is wrong.
TEST(HandEye, AViewThatAloneGivesTheTurnIsNotCleared) {
  Random random(15);
  RobotScene scene = robot_scene(HandEyeSetup::eye_to_hand, 6, 30, random);
  // Turns of the board before the camera are turns of the hand about an axis of its own.
  const Pose X_CB = scene.X_FC.inverse() * scene.X_RH[0] * scene.X_GB;
  for (std::size_t v = 0; v < scene.X_RH.size(); ++v) {
    Pose turned = X_CB;
    turned.linear() = X_CB.linear() * exp_so3((v == 5 ? 0.4 : 0.12 * static_cast<double>(v)) *
                                              (v == 5 ? Vector3d::UnitX() : Vector3d::UnitZ()));
    turned.translation() += Vector3d(5.0 * static_cast<double>(v), -3.0 * static_cast<double>(v % 3), 20);
    scene.X_RH[v] = scene.X_FC * turned * scene.X_GB.inverse();
  }
  auto views = scene.views({0.02, 0.01, 0.002}, random);
  ASSERT_EQ(solve(scene, views).status, HandEyeStatus::ok) << solve(scene, views).reason;
  views[5].X_RH.translation() += Vector3d(9, 9, 9);
  const HandEyeResult result = solve(scene, views);
  ASSERT_EQ(result.status, HandEyeStatus::contradiction);
  EXPECT_THAT(result.suspects, Contains(5u));
}

TEST(HandEye, WithThreeViewsNobodyKnowsWhichIsWrong) {
  Random random(9);
  const RobotScene scene = robot_scene(HandEyeSetup::eye_to_hand, 3, 30, random);
  auto views = scene.views(usual, random);
  views[1].X_RH.translation() += Vector3d(3, 3, 3);
  HandEyeProblem problem = scene.problem(views);
  problem.robot_sigma_mm = 0.05, problem.robot_sigma_deg = 0.01, problem.sigma_px = 0.1;
  const HandEyeResult result = calibrate_hand_eye(problem);
  EXPECT_EQ(result.status, HandEyeStatus::contradiction);
  EXPECT_THAT(result.removed, IsEmpty());
}

TEST(HandEye, SwappedViewsAreNamed) {
  Random random(10);
  for (const HandEyeSetup setup : setups)
    for (const std::size_t count : {5u, 12u}) {
      const RobotScene scene = robot_scene(setup, count, 30, random);
      auto views = scene.views(usual, random);
      std::swap(views[1].X_RH, views[4].X_RH);
      const HandEyeResult result = solve(scene, views);
      std::string all = result.reason;
      for (const std::string& warning : result.warnings) all += "\n" + warning;
      EXPECT_THAT(all, HasSubstr("views 2 and 5 look swapped"));
      if (result.status != HandEyeStatus::ok) continue;
      EXPECT_THAT(result.removed, UnorderedElementsAre(1u, 4u));
      EXPECT_LT(test::distance_mm(result.X_FC, scene.X_FC), 1);
    }
}

TEST(HandEye, PosesShiftedByOneViewAreNamed) {
  Random random(11);
  const RobotScene scene = robot_scene(HandEyeSetup::eye_to_hand, 8, 30, random);
  auto views = scene.views(usual, random);
  const Pose first = views[0].X_RH;
  for (std::size_t v = 0; v + 1 < views.size(); ++v) views[v].X_RH = views[v + 1].X_RH;
  views.back().X_RH = first;
  const HandEyeResult result = solve(scene, views);
  EXPECT_EQ(result.status, HandEyeStatus::contradiction);
  EXPECT_THAT(result.reason, HasSubstr("shifted by one view"));
}

HandEyeResult solve_with(const RobotScene& scene, std::vector<HandEyeView> views,
                         const std::function<Pose(const Pose&)>& wrong) {
  for (HandEyeView& view : views) view.X_RH = wrong(view.X_RH);
  return solve(scene, views);
}

TEST(HandEye, OtherReadingsAreRecognised) {
  Random random(12);
  for (const HandEyeSetup setup : setups) {
    const RobotScene scene = robot_scene(setup, 9, 30, random);
    const auto views = scene.views(usual, random);
    const HandEyeResult inverse = solve_with(scene, views, [](const Pose& X) { return X.inverse(); });
    EXPECT_EQ(inverse.status, HandEyeStatus::contradiction);
    EXPECT_THAT(inverse.reason, HasSubstr("look like X_HR, not X_RH"));
    EXPECT_THAT(inverse.reason,
                HasSubstr(setup == HandEyeSetup::eye_in_hand ? "beside the robot" : "on the hand"));
    const HandEyeResult metres = solve_with(scene, views, [](Pose X) {
      X.translation() /= 1000;
      return X;
    });
    EXPECT_NE(metres.status, HandEyeStatus::ok);
    EXPECT_THAT(metres.reason, HasSubstr("metres"));
    const HandEyeResult radians = solve_with(scene, views, [](const Pose& X) {
      SixNumbers six = to_six_numbers(X);
      six.rx_deg /= degrees_per_radian, six.ry_deg /= degrees_per_radian, six.rz_deg /= degrees_per_radian;
      return from_six_numbers(six);
    });
    EXPECT_NE(radians.status, HandEyeStatus::ok);
    EXPECT_THAT(radians.reason, HasSubstr("radians"));
  }
}

TEST(HandEye, AWrongPitchIsSaid) {
  Random random(13);
  for (const HandEyeSetup setup : setups) {
    RobotScene scene = robot_scene(setup, 10, 30, random);
    scene.board_scale = 1.01;
    const HandEyeResult one_percent = solve(scene, scene.views(usual, random));
    ASSERT_EQ(one_percent.status, HandEyeStatus::ok) << one_percent.reason;
    EXPECT_THAT(one_percent.warnings, Contains(HasSubstr("% too small")));
    EXPECT_NEAR(one_percent.scale, 1.01, 4 * one_percent.scale_sigma);
    scene.board_scale = 0.5;
    const HandEyeResult half = solve(scene, scene.views(usual, random));
    EXPECT_EQ(half.status, HandEyeStatus::contradiction);
    EXPECT_THAT(half.reason, HasSubstr("times too large"));
    EXPECT_NEAR(std::stod(half.reason.substr(half.reason.find("look ") + 5)), 2, 0.02) << half.reason;
    scene.board_scale = 1;
    const HandEyeResult right = solve(scene, scene.views(usual, random));
    EXPECT_THAT(right.warnings, IsEmpty());
  }
}

TEST(HandEye, AnotherCamerasInternalsAreRefused) {
  Random random(15);
  for (const HandEyeSetup setup : setups) {
    const RobotScene scene = robot_scene(setup, 10, 30, random);
    const auto views = scene.views(usual, random);
    HandEyeProblem problem = scene.problem(views);
    problem.model.fx_px *= 2;
    problem.model.fy_px *= 2;
    problem.model.cx_px += 40;
    const HandEyeResult result = calibrate_hand_eye(problem);
    EXPECT_NE(result.status, HandEyeStatus::ok);
    EXPECT_FALSE(result.reason.empty());
  }
}

// How far points miss their pixels is counted in px, whatever their covariances say.
TEST(HandEye, PixelsThatAreFarMoreCertainThanTheyAreGoodAreNoOtherCamera) {
  Random random(16);
  for (const HandEyeSetup setup : setups) {
    const RobotScene scene = robot_scene(setup, 10, 30, random);
    auto views = scene.views(usual, random);
    for (HandEyeView& view : views)
      for (CalibrationPoint& point : view.points) point.covariance_px2 *= 1e-4;
    const HandEyeResult result = calibrate_hand_eye(scene.problem(views));
    EXPECT_EQ(result.status, HandEyeStatus::ok) << result.reason;
    EXPECT_GT(result.sigma_px, 1);
  }
}

TEST(HandEye, DiscsAreFreeOfTheirEccentricity) {
  Random random(14);
  const RobotScene scene = robot_scene(HandEyeSetup::eye_to_hand, 6, 35, random);
  auto views = scene.views({}, random);
  for (HandEyeView& view : views) {
    const Pose X_CB = scene.X_FC.inverse() * view.X_RH * scene.X_GB;
    for (CalibrationPoint& point : view.points) {
      point.disc_radius_mm = 12;
      point.disc_normal_W = Vector3d::UnitZ();
      // The outline, point by point, and the centre of its bounding ellipse's area.
      Eigen::Vector2d sum = Eigen::Vector2d::Zero();
      double area = 0;
      constexpr int corners = 720;
      const auto outline = [&](int k) {
        const double angle = 2 * M_PI * k / corners;
        return test::photograph(scene.model, X_CB.inverse(),
                                point.p_W_mm + 12 * Vector3d(std::cos(angle), std::sin(angle), 0));
      };
      for (int k = 0; k < corners; ++k) {
        const Eigen::Vector2d a = outline(k) - point.u_px, b = outline(k + 1) - point.u_px;
        const double cross = a.x() * b.y() - a.y() * b.x();
        area += cross / 2;
        sum += (a + b) * cross / 6;
      }
      point.u_px += sum / area;
    }
  }
  const HandEyeResult result = solve(scene, views);
  ASSERT_EQ(result.status, HandEyeStatus::ok) << result.reason;
  // What is left is the lens across a disc; as points they would be off by half a millimetre.
  EXPECT_LT(test::distance_mm(result.X_FC, scene.X_FC), 0.02);
  for (HandEyeView& view : views)
    for (CalibrationPoint& point : view.points) point.disc_radius_mm = 0;
  EXPECT_GT(test::distance_mm(solve(scene, views).X_FC, scene.X_FC), 0.05);
}

}  // namespace
}  // namespace zeropose
