// From pictures to even gaps: six cameras on the hand, rounds of a robot that does what it is told or 10 %
// more.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <iostream>

#include "measure/gap.h"
#include "measure/gap_evening.h"
#include "tests/measure/pane_scene.h"
#include "tests/support/gap_scene.h"

namespace zeropose {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using test::degree;
using test::GapScene;
using test::in_plane;
using test::on;

constexpr double gap_mm = 4;

// H is T: the pane's plane is z = 0 of the hand.
struct HandCamera {
  PaneGap place;
  GapScene scene;
  Pose X_HG = Pose::Identity();  // x from the frame to the pane, y along the gap, origin in its middle
};

std::vector<HandCamera> hand_cameras(std::mt19937_64& random) {
  std::vector<HandCamera> cameras;
  for (const PaneGap& place : test::pane_gaps(gap_mm)) {
    HandCamera camera{place, test::random_gap(random)};
    camera.scene.gap_mm = gap_mm;
    camera.scene.wedge_rad = 0;
    camera.X_HG.translation() = on(place.p_T_mm + 0.5 * gap_mm * place.outward_T);
    camera.X_HG.linear().col(0) = -on(place.outward_T);
    camera.X_HG.linear().col(1) = Vector3d::UnitZ().cross(-on(place.outward_T));
    camera.X_HG.linear().col(2) = Vector3d::UnitZ();
    Pose X_CG = Pose::Identity();
    X_CG.linear() = camera.scene.R_CG();
    X_CG.translation() = camera.scene.centre_C_mm();
    camera.scene.X_HC = camera.X_HG * X_CG.inverse();
    cameras.push_back(camera);
  }
  return cameras;
}

// The frame, straight at each place and even at identity, while it stands at X_HF.
GapScene seen(const HandCamera& camera, const Pose& X_HF) {
  const Pose X_GF = camera.X_HG.inverse() * X_HF;
  const Vector3d foot = X_GF * on(camera.place.p_T_mm + gap_mm * camera.place.outward_T);
  const Vector3d outward = X_GF.linear() * on(camera.place.outward_T);
  GapScene scene = camera.scene;
  scene.frame_off_mm = -outward.dot(foot) / outward.x() - 0.5 * gap_mm;
  scene.frame_turn_rad = std::atan2(-outward.y(), -outward.x());
  return scene;
}

std::vector<PaneGap> measured(const std::vector<HandCamera>& cameras, const Pose& X_HF,
                              std::mt19937_64& random) {
  std::vector<PaneGap> gaps;
  for (const HandCamera& camera : cameras) {
    const GapScene scene = seen(camera, X_HF);
    const test::Pixels pixels = test::expose(test::paint(scene), 2, random);
    GapProblem problem = test::problem_of(scene);
    problem.search.half_across_px = 80;
    problem.image = pixels.view();
    const GapResult gap = measure_gap(problem);
    EXPECT_EQ(gap.status, GapStatus::ok) << gap.reason;
    gaps.push_back({camera.place.name, gap.pane.p_H_mm.head<2>(), gap.outward_H.head<2>(), gap.gap_mm,
                    gap.sigma_mm, 1, 0});
  }
  return gaps;
}

// The largest deviation of the true gaps from their middle.
double unevenness_mm(const std::vector<HandCamera>& cameras, const Pose& X_HF) {
  double low = INFINITY, high = -INFINITY;
  for (const HandCamera& camera : cameras) {
    const double off = seen(camera, X_HF).frame_off_mm;
    low = std::min(low, off), high = std::max(high, off);
  }
  return 0.5 * (high - low);
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
  std::vector<HandCamera> cameras_ = hand_cameras(random_);
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
