// The motion that evens the gaps: what is left open, contradictions, faults, limits.
#include <gtest/gtest.h>

#include <cmath>

#include "measure/gap_evening.h"
#include "tests/measure/pane_scene.h"

namespace zeropose {
namespace {

using Eigen::Vector2d;
using test::degree;
using test::pane_gaps;
using test::problem_of;
using test::widen;

// ---- what is open

void expect(const EveningResult& result, Code code, const std::string& words) {
  EXPECT_EQ(text_of(result.code).name, text_of(code).name) << result.reason;
  EXPECT_NE(result.reason.find(words), std::string::npos) << result.reason;
}

TEST(GapEvening, TooFewGaps) {
  const std::vector<PaneGap> all = pane_gaps();
  const std::vector<PaneGap> three{all[0], all[2], all[5]}, two{all[0], all[2]};
  expect(even_gaps(problem_of(three)), Code::too_few_marks, "3 gaps with a weight, evening needs 4");
  EveningProblem problem = problem_of(three);
  problem.even = false;
  EXPECT_EQ(even_gaps(problem).code, Code::ok);
  problem.gaps = two;
  expect(even_gaps(problem), Code::too_few_marks, "x, y and rz need 3");
  std::vector<PaneGap> four{all[0], all[2], all[4], all[5]};
  EXPECT_EQ(even_gaps(problem_of(four)).redundancy, 0);
  four[1].weight = 0;
  expect(even_gaps(problem_of(four)), Code::too_few_marks, "3 gaps with a weight");
}

TEST(GapEvening, TwoOppositeSidesLeaveAShiftOpen) {
  std::vector<PaneGap> gaps = pane_gaps();
  gaps = {gaps[0], gaps[1], gaps[4], gaps[5]};
  for (PaneGap& gap : gaps) gap.outward_T = {0, gap.outward_T.y() > 0 ? 1. : -1.};
  expect(even_gaps(problem_of(gaps)), Code::geometry_degenerate, "open a shift along (1.00, 0.00)");
}

TEST(GapEvening, ARoundPaneMayTurn) {
  std::vector<PaneGap> gaps;
  for (int k = 0; k < 6; ++k) {
    const Vector2d n(std::cos(1.1 * k), std::sin(1.1 * k));
    gaps.push_back({"", Vector2d(100, 50) + 300 * n, n, 4, 0.01, 1, 0});
  }
  expect(even_gaps(problem_of(gaps)), Code::geometry_degenerate, "open a turn about (100, 50) mm");
}

// Two adjacent sides: a shift along the diagonal widens or narrows all gaps alike.
TEST(GapEvening, AdjacentSidesDoNotTellAShiftFromTheCommonGap) {
  std::vector<PaneGap> gaps;
  for (const double at : {100., 600.}) {
    gaps.push_back({"", {at, 0}, {0, -1}, 4, 0.01, 1, 0});
    gaps.push_back({"", {0, at}, {-1, 0}, 4, 0.01, 1, 0});
  }
  expect(even_gaps(problem_of(gaps)), Code::geometry_degenerate,
         "open a shift along (0.71, 0.71) of the pane's frame together with the common gap");
  EveningProblem wanted = problem_of(gaps);
  wanted.even = false;
  EXPECT_EQ(even_gaps(wanted).code, Code::ok);
}

// ---- contradiction, faults, limits

TEST(GapEvening, AGapThatContradictsIsNamed) {
  std::vector<PaneGap> gaps = pane_gaps();
  gaps.push_back({"top3", {600, 700}, {0, 1}, 4, 0.01, 1, 0});
  gaps.push_back({"right2", {1200, 600}, {1, 0}, 4, 0.01, 1, 0});
  widen(gaps, 0.5, 1, 0.001);
  const EveningResult clean = even_gaps(problem_of(gaps));
  gaps[6].gap_mm += 0.5;
  const EveningResult result = even_gaps(problem_of(gaps));
  ASSERT_EQ(result.code, Code::ok) << result.reason;
  EXPECT_EQ(result.removed, std::vector<std::size_t>{6});
  EXPECT_NEAR(result.x_mm, clean.x_mm, 1e-9);
  EXPECT_NEAR(result.predicted_mm[6], 4.5, 1e-6);  // 0.5 mm times half of the turn squared
  EXPECT_EQ(result.redundancy, 3);
  EveningProblem real = problem_of(gaps);  // pane and frame are not better than that
  real.shape_sigma_mm = 0.3;
  EXPECT_TRUE(even_gaps(real).removed.empty());
}

TEST(GapEvening, TwoGapsThatContradictEachOtherAreSuspects) {
  std::vector<PaneGap> gaps;
  for (const double at : {100., 350., 600., 850.}) {
    gaps.push_back({"low", {at, 0}, {0, -1}, 4, 0.01, 1, 4});
    gaps.push_back({"top", {at, 700}, {0, 1}, 4, 0.01, 1, 4});
  }
  gaps.push_back({"left", {0, 300}, {-1, 0}, 4, 0.01, 1, 4});
  gaps.push_back({"right", {1200, 300}, {1, 0}, 4, 0.01, 1, 4});
  gaps[0].gap_mm += 0.5;
  EveningProblem problem = problem_of(gaps);
  problem.even = false;
  EXPECT_EQ(even_gaps(problem).removed, std::vector<std::size_t>{0});
  gaps[0].gap_mm = 4;
  gaps[8].gap_mm = 5;  // left and right contradict each other, and no other gap tells which is wrong
  const EveningResult result = even_gaps(problem);
  expect(result, Code::deviation_not_attributable, "wrong is one of left, right");
}

// The gaps above and below tell the shift along x by their slight inclination: enough to see that the one at
// the left is wrong, not enough to do without it.
TEST(GapEvening, WithoutTheWrongGapAMotionIsOpen) {
  std::vector<PaneGap> gaps;
  for (const double at : {100., 350., 600., 850.}) {
    gaps.push_back({"low", {at, 0}, {0, -1}, 4, 0.01, 1, 4});
    gaps.push_back({"top", {at, 700}, Vector2d(0.015, 1).normalized(), 4, 0.01, 1, 4});
  }
  gaps.push_back({"left", {0, 300}, {-1, 0}, 4, 0.01, 1, 4});
  EveningProblem problem = problem_of(gaps);
  problem.even = false;
  gaps[1].gap_mm = 4.01;
  EXPECT_EQ(even_gaps(problem).code, Code::ok);
  gaps[8].gap_mm = 14;
  expect(even_gaps(problem), Code::geometry_degenerate,
         "without the gap that contradicts them the gaps leave open a shift along (1.00, ");
}

// With one gap more than unknowns it is seen that one is wrong, but not which.
TEST(GapEvening, FiveGapsOnlySayThatOneIsWrong) {
  std::vector<PaneGap> gaps = pane_gaps();
  gaps.pop_back();
  gaps[3].gap_mm += 0.5;
  const EveningResult result = even_gaps(problem_of(gaps));
  expect(result, Code::deviation_not_attributable, "the gaps contradict each other");
  EXPECT_EQ(result.redundancy, 1);
  EveningProblem problem = problem_of(gaps);  // unless they are as even as is asked for
  problem.tolerance_mm = 0.3;
  EXPECT_TRUE(even_gaps(problem).even_already);
}

TEST(GapEvening, Faults) {
  const auto wrong = [](const std::string& words, auto change) {
    std::vector<PaneGap> gaps = pane_gaps();
    change(gaps[2]);
    expect(even_gaps(problem_of(gaps)), Code::marks_invalid, "gap left has " + words);
  };
  wrong("a number that is not finite", [](PaneGap& gap) { gap.gap_mm = NAN; });
  wrong("a number that is not finite", [](PaneGap& gap) { gap.p_T_mm.x() = INFINITY; });
  wrong("a sigma that is not positive", [](PaneGap& gap) { gap.sigma_mm = 0; });
  wrong("a weight of 1.50", [](PaneGap& gap) { gap.weight = 1.5; });
  wrong("an outward direction of length 2.0", [](PaneGap& gap) { gap.outward_T *= 2; });
  const std::vector<PaneGap> gaps = pane_gaps();
  EveningProblem problem = problem_of(gaps);
  problem.max_y_mm = 0;
  expect(even_gaps(problem), Code::argument_out_of_range, "limits");
  problem = problem_of(gaps);
  problem.tolerance_mm = 0;
  expect(even_gaps(problem), Code::argument_out_of_range, "tolerance");
  problem = problem_of(gaps);
  problem.shape_sigma_mm = NAN;
  expect(even_gaps(problem), Code::argument_out_of_range, "shape");
}

TEST(GapEvening, BeyondALimitItIsRefusedNotShortened) {
  std::vector<PaneGap> gaps = pane_gaps();
  widen(gaps, 3, 2, 0.01);
  EveningProblem problem = problem_of(gaps);
  problem.max_x_mm = 2.9;
  const EveningResult result = even_gaps(problem);
  expect(result, Code::limit_x, "x = 3.000 mm, at most 2.900 mm");
  EXPECT_NEAR(result.x_mm, 3, 1e-9);
  problem = problem_of(gaps);
  problem.max_y_mm = 1.9;
  expect(even_gaps(problem), Code::limit_y, "y = 2.000 mm");
  problem = problem_of(gaps);
  problem.max_rz_rad = 0.5 * degree;
  expect(even_gaps(problem), Code::limit_rz, "rz = 0.573 deg, at most 0.500 deg");
}

TEST(GapEvening, WithinTheToleranceNothingMoves) {
  std::vector<PaneGap> gaps = pane_gaps();
  gaps[0].gap_mm = 4.18;
  for (PaneGap& gap : gaps) gap.sigma_mm = 0.1;
  EveningProblem problem = problem_of(gaps);
  problem.tolerance_mm = 0.0901;
  const EveningResult still = even_gaps(problem);
  ASSERT_EQ(still.code, Code::ok) << still.reason;
  EXPECT_TRUE(still.even_already);
  EXPECT_NEAR(still.worst_mm, 0.09, 1e-12);
  EXPECT_TRUE(still.X_TTn.matrix().isIdentity(0));
  EXPECT_NEAR(still.predicted_mm[0], 4.18, 1e-12);
  problem.tolerance_mm = 0.0899;
  const EveningResult moves = even_gaps(problem);
  EXPECT_FALSE(moves.even_already);
  EXPECT_GT(std::abs(moves.y_mm), 0.01);
  problem.tolerance_mm = 0.1;
  problem.even = false;  // the wanted gaps are 0
  EXPECT_FALSE(even_gaps(problem).even_already);
}

}  // namespace
}  // namespace zeropose
