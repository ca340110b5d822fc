// The gap in one camera: laws, every reason.
#include "measure/gap.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>

#include "tests/support/gap_scene.h"

namespace zeropose {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using test::expose;
using test::GapScene;
using test::measured;
using test::paint;
using test::Picture;
using test::Pixels;
using test::problem_of;
using test::random_gap;

constexpr double noise = 2;

// Each edge of its own sense, also both alike.
TEST(Gap, AnySensesOfTheEdges) {
  std::mt19937_64 random(6);
  for (const auto& [frame, gap, pane] :
       {std::array{150., 50., 120.}, {50., 150., 80.}, {40., 100., 170.}, {170., 100., 40.}}) {
    GapScene scene = random_gap(random);
    scene.frame_grey = frame, scene.gap_grey = gap, scene.pane_grey = pane;
    const GapResult result = measured(scene, random);
    ASSERT_EQ(result.status, GapStatus::ok) << result.reason;
    EXPECT_LT(std::abs(result.gap_mm - scene.gap_mm), 4 * result.sigma_mm);
  }
}

// ---- laws

TEST(Gap, PlacesAndDirectionsAreThoseOfTheHand) {
  std::mt19937_64 random(7);
  for (int phase = 0; phase < 5; ++phase) {
    const GapScene scene = random_gap(random);
    const GapResult result = measured(scene, random);
    ASSERT_EQ(result.status, GapStatus::ok) << result.reason;
    const Pose X_CH = scene.X_HC.inverse();
    const Eigen::Matrix3d R_GH = scene.R_CG().transpose() * X_CH.linear();
    const auto p_G = [&](const GapEdge& edge) {
      return Vector3d(scene.R_CG().transpose() * (X_CH * edge.p_H_mm - scene.centre_C_mm()));
    };
    // Sigmas of 0.001 mm across; along, what the mean direction's sigma of 3e-4 turns over half the gap.
    EXPECT_LT((p_G(result.frame) - Vector3d(-scene.gap_mm / 2, 0, 0)).norm(), 0.01);
    EXPECT_LT((p_G(result.pane) - Vector3d(scene.gap_mm / 2, 0, 0)).norm(), 0.01);
    EXPECT_LT((R_GH * result.outward_H - Vector3d(-1, 0, 0)).norm(), 0.002);
    EXPECT_NEAR(result.outward_H.norm(), 1, 1e-12);
    EXPECT_NEAR((result.frame.p_H_mm - result.pane.p_H_mm).norm(), result.gap_mm, 1e-9);
    const double wedge = result.wedge_rad / 2;
    EXPECT_LT((R_GH * result.pane.along_H - Vector3d(std::sin(wedge), std::cos(wedge), 0)).norm(), 0.002);
    EXPECT_LT((R_GH * result.frame.along_H - Vector3d(-std::sin(wedge), std::cos(wedge), 0)).norm(), 0.002);
  }
}

// The hand's frame, and which point and normal give the plane, are names only; twice as far is twice as wide.
TEST(Gap, HandAndPlaneAreNamesAndDistanceIsScale) {
  std::mt19937_64 random(8);
  const GapScene scene = random_gap(random);
  const Pixels pixels = expose(paint(scene), noise, random);
  GapProblem problem = problem_of(scene);
  problem.image = pixels.view();
  const GapResult first = measure_gap(problem);
  ASSERT_EQ(first.status, GapStatus::ok) << first.reason;
  const Pose X_KH = Eigen::Translation3d(30, -70, 110) * Eigen::AngleAxisd(1.1, Vector3d(1, 2, 2) / 3);
  GapProblem other = problem;
  other.camera.X_WC = X_KH * problem.camera.X_WC;
  other.plane.p_H_mm = X_KH * problem.plane.p_H_mm;
  other.plane.n_H = -0.2 * (X_KH.linear() * problem.plane.n_H);
  const GapResult second = measure_gap(other);
  EXPECT_NEAR(second.gap_mm, first.gap_mm, 1e-9);
  EXPECT_NEAR(second.sigma_mm, first.sigma_mm, 1e-9);
  EXPECT_NEAR(second.wedge_rad, first.wedge_rad, 1e-11);
  EXPECT_LT((second.pane.p_H_mm - X_KH * first.pane.p_H_mm).norm(), 1e-9);
  EXPECT_LT((second.outward_H - X_KH.linear() * first.outward_H).norm(), 1e-11);
  const Vector3d eye_H = problem.camera.X_WC.translation();
  other = problem;
  other.plane.p_H_mm = eye_H + 2 * (problem.plane.p_H_mm - eye_H);
  other.search.max_gap_mm *= 2;
  EXPECT_NEAR(measure_gap(other).gap_mm, 2 * first.gap_mm, 1e-9);
}

// Frame and pane change places: the same gap, the other way.
TEST(Gap, FromTheOtherSide) {
  std::mt19937_64 random(9);
  const GapScene scene = random_gap(random);
  const Pixels pixels = expose(paint(scene), noise, random);
  GapProblem problem = problem_of(scene);
  problem.image = pixels.view();
  const GapResult first = measure_gap(problem);
  problem.search.direction_rad += std::acos(-1.0);
  std::swap(problem.search.frame, problem.search.pane);
  const auto turned = [](EdgeSense sense) {
    return sense == EdgeSense::dark_to_bright ? EdgeSense::bright_to_dark : EdgeSense::dark_to_bright;
  };
  problem.search.frame = turned(problem.search.frame);
  problem.search.pane = turned(problem.search.pane);
  const GapResult second = measure_gap(problem);
  ASSERT_EQ(first.status, GapStatus::ok) << first.reason;
  ASSERT_EQ(second.status, GapStatus::ok) << second.reason;
  EXPECT_NEAR(second.gap_mm, first.gap_mm, 1e-9);
  EXPECT_NEAR(second.wedge_rad, -first.wedge_rad, 1e-11);
  EXPECT_LT((second.outward_H + first.outward_H).norm(), 1e-9);
}

// ---- reasons

class GapReason : public testing::Test {
 protected:
  GapReason() { scene_.turn_rad = 0.3; }
  GapResult look() { return look(problem_of(scene_)); }
  GapResult look(GapProblem problem) {
    pixels_ = expose(paint(scene_), noise, random_);
    problem.image = pixels_.view();
    return measure_gap(problem);
  }
  static void expect(const GapResult& result, GapStatus status, const std::string& words) {
    EXPECT_EQ(name_of(result.status), name_of(status)) << result.reason;
    EXPECT_NE(result.reason.find(words), std::string::npos) << result.reason;
  }

  std::mt19937_64 random_{10};
  GapScene scene_;
  Pixels pixels_;
};

TEST_F(GapReason, OkHasNone) {
  const GapResult result = look();
  EXPECT_EQ(result.status, GapStatus::ok);
  EXPECT_EQ(result.reason, "");
}

TEST_F(GapReason, AnEdgeOutOfSight) {
  GapProblem problem = problem_of(scene_);
  scene_.pane_grey = scene_.gap_grey;
  expect(look(problem), GapStatus::edge_not_found, "the pane's edge");
  scene_.pane_grey = 120;
  scene_.frame_grey = scene_.gap_grey;
  expect(look(problem), GapStatus::edge_not_found, "the frame's edge");
}

TEST_F(GapReason, OneEdgeWhereTwoOfOneSenseAreExpected) {
  scene_.frame_grey = 40, scene_.gap_grey = 100, scene_.pane_grey = 170;
  const GapProblem problem = problem_of(scene_);
  scene_.frame_grey = 100;
  expect(look(problem), GapStatus::edge_not_found, "one edge is seen");
}

TEST_F(GapReason, Contrast) {
  const GapProblem problem = problem_of(scene_);
  scene_.frame_grey = scene_.gap_grey + 5, scene_.pane_grey = scene_.gap_grey + 5;
  GapResult result = look(problem);
  EXPECT_TRUE(result.status == GapStatus::low_contrast || result.status == GapStatus::edge_not_found);
  EXPECT_NE(result.reason.find("edge: "), std::string::npos) << result.reason;
  scene_.frame_grey = scene_.gap_grey + 14;
  GapProblem asks_more = problem;
  asks_more.search.min_contrast = 16;
  expect(look(asks_more), GapStatus::low_contrast, "at least 16.0 are needed");
}

TEST_F(GapReason, Saturated) {
  scene_.frame_grey = 270;
  expect(look(), GapStatus::edge_not_found, "the frame's edge: white is reached");
}

TEST_F(GapReason, Wedge) {
  scene_.wedge_rad = 0.08;
  expect(look(), GapStatus::not_parallel, "turned against each other by 4.5");
}

TEST_F(GapReason, TooWideAndTooNarrow) {
  GapProblem problem = problem_of(scene_);
  problem.search.max_gap_mm = 3;
  expect(look(problem), GapStatus::out_of_range, "expected 1.50 to 3.00 mm");
  problem.search.min_gap_mm = 5;
  problem.search.max_gap_mm = 6;
  expect(look(problem), GapStatus::out_of_range, "expected 5.00 to 6.00 mm");
}

// A pane that is seen through: its edge lies beyond the frame's.
TEST_F(GapReason, Overlap) {
  GapProblem problem = problem_of(scene_);
  scene_.gap_mm = 3;
  problem.search.direction_rad += std::acos(-1.0);
  problem.search.frame = EdgeSense::bright_to_dark;
  problem.search.pane = EdgeSense::dark_to_bright;
  std::swap(scene_.frame_grey, scene_.gap_grey);
  scene_.pane_grey = scene_.frame_grey;
  expect(look(problem), GapStatus::overlap, "beyond the frame's: the gap is -3.0");
}

TEST_F(GapReason, BesideTheWindow) {
  GapProblem problem = problem_of(scene_);
  problem.search.half_across_px = 25;
  problem.search.half_along_px = 90;
  expect(look(problem), GapStatus::outside_window, "from the window's centre, which has 25.0 px");
}

TEST_F(GapReason, OutsideTheImage) {
  GapProblem problem = problem_of(scene_);
  problem.search.centre_px = {400, 100};
  expect(look(problem), GapStatus::outside_image, "outside the image");
}

// A second edge of the pane, as strong as the first: a chamfer. A smaller range decides.
TEST_F(GapReason, TwoEdgesOfThePane) {
  scene_.dirt = {test::streak(scene_, false, -9, 9, 0.6, 0.7, 50)};
  GapProblem problem = problem_of(scene_);
  expect(look(problem), GapStatus::ambiguous, "several pairs of edges");
  problem.search.max_gap_mm = 4.5;
  const GapResult result = look(problem);
  ASSERT_EQ(result.status, GapStatus::ok) << result.reason;
  EXPECT_NEAR(result.gap_mm, scene_.gap_mm, 4 * result.sigma_mm);
}

TEST_F(GapReason, WrongProblems) {
  const auto wrong = [this](const std::string& words, auto change) {
    GapProblem problem = problem_of(scene_);
    change(problem);
    expect(look(problem), GapStatus::wrong_problem, words);
  };
  wrong("centre or direction", [](GapProblem& p) { p.search.direction_rad = NAN; });
  wrong("half sizes", [](GapProblem& p) { p.search.half_along_px = 1; });
  wrong("range of positive numbers", [](GapProblem& p) { p.search.min_gap_mm = 0; });
  wrong("range of positive numbers", [](GapProblem& p) { p.search.max_gap_mm = 1; });
  wrong("direction and wedge", [](GapProblem& p) { p.search.max_wedge_rad = 0; });
  wrong("length share", [](GapProblem& p) { p.search.min_length_share = 2; });
  wrong("normal", [](GapProblem& p) { p.plane.n_H.setZero(); });
  wrong("calibrated with 241 x 200", [](GapProblem& p) { p.camera.model.width_px = 241; });
  wrong("calibration", [](GapProblem& p) { p.camera.model.fx_px = 0; });
  wrong("does not meet the plane", [](GapProblem& p) {
    p.plane.p_H_mm = p.camera.X_WC * Vector3d(0, 0, -100);
    p.plane.n_H = p.camera.X_WC.linear().col(2);
  });
  wrong("does not meet the plane", [](GapProblem& p) { p.plane.n_H = p.camera.X_WC.linear().col(0); });
}

}  // namespace
}  // namespace zeropose
