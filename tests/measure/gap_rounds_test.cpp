// From pictures to even gaps: six cameras on the hand, rounds of a robot that does what it is told or 10 %
// more.
#include <gtest/gtest.h>

#include <iostream>

#include "measure/gap.h"
#include "measure/gap_evening.h"
#include "tests/measure/pane_cameras.h"

namespace zeropose {
namespace {

using test::degree;
using test::GapScene;
using test::in_plane;
using test::PaneCamera;
using test::unevenness_mm;

std::vector<PaneGap> measured(const std::vector<PaneCamera>& cameras, const Pose& X_HF,
                              std::mt19937_64& random) {
  std::vector<PaneGap> gaps;
  for (const PaneCamera& camera : cameras) {
    const GapScene scene = test::seen(camera, X_HF);
    const test::Pixels pixels = test::expose(test::paint(scene), 2, random);
    GapProblem problem = test::wide_problem_of(scene);
    problem.image = pixels.view();
    const GapResult gap = measure_gap(problem);
    EXPECT_EQ(gap.status, GapStatus::ok) << gap.reason;
    gaps.push_back({camera.place.name, gap.pane.p_H_mm.head<2>(), gap.outward_H.head<2>(), gap.gap_mm,
                    gap.sigma_mm, 1, 0});
  }
  return gaps;
}

class GapRounds : public testing::Test {
 protected:
  // The rounds it took, each evening what the last one left.
  int even_by_rounds(double gain) {
    for (int round = 0; round < 5; ++round) {
      const std::vector<PaneGap> gaps = measured(cameras_, X_HF_, random_);
      EveningProblem problem;
      problem.gaps = gaps;
      problem.shape_sigma_mm = 0.01;
      problem.tolerance_mm = 0.05;
      problem.max_x_mm = problem.max_y_mm = 5;
      problem.max_rz_rad = degree;
      const EveningResult result = even_gaps(problem);
      EXPECT_EQ(result.code, Code::ok) << result.reason;
      EXPECT_NEAR(result.worst_mm, unevenness_mm(cameras_, X_HF_), 0.01);
      if (result.code != Code::ok || result.even_already) return round;
      X_HF_ = in_plane(gain * result.x_mm, gain * result.y_mm, gain * result.rz_rad).inverse() * X_HF_;
      left_mm_.push_back(unevenness_mm(cameras_, X_HF_));
    }
    return 5;
  }

  std::mt19937_64 random_{21};
  std::vector<PaneCamera> cameras_ = test::pane_cameras(random_);
  Pose X_HF_ = in_plane(0.5, -0.4, 0.06 * degree);
  std::vector<double> left_mm_;
};

TEST_F(GapRounds, OneMotionDoesIt) {
  EXPECT_GT(unevenness_mm(cameras_, X_HF_), 0.5);
  EXPECT_EQ(even_by_rounds(1), 1);
  // Noise of 0.001 mm; half of the wedge of 0.001 rad times the shift of 1 mm.
  EXPECT_LT(left_mm_.at(0), 0.005);
  std::cout << "uneven by " << left_mm_[0] << " mm after one motion\n";
}

TEST_F(GapRounds, ARobotThatIsOffNeedsMore) {
  const int rounds = even_by_rounds(1.1);
  EXPECT_LE(rounds, 4);
  EXPECT_LT(left_mm_.back(), 0.1);
  std::cout << rounds << " motions, uneven by " << left_mm_.back() << " mm\n";
}

}  // namespace
}  // namespace zeropose
