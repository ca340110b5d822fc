// Six cameras on a hand that see the gaps round a pane, each a drawn picture (tests/support/gap_scene.h).
#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

#include "tests/measure/pane_scene.h"
#include "tests/support/gap_scene.h"

namespace zeropose::test {

inline constexpr double even_gap_mm = 4;

// H is T: the pane's plane is z = 0 of the hand.
struct PaneCamera {
  PaneGap place;
  GapScene scene;
  Pose X_HG = Pose::Identity();  // x from the frame to the pane, y along the gap, origin in its middle
};

inline std::vector<PaneCamera> pane_cameras(std::mt19937_64& random,
                                            const std::vector<PaneGap>& places = pane_gaps(even_gap_mm)) {
  std::vector<PaneCamera> cameras;
  for (const PaneGap& place : places) {
    PaneCamera camera{place, random_gap(random)};
    camera.scene.gap_mm = even_gap_mm;
    camera.scene.wedge_rad = 0;
    camera.X_HG.translation() = on(place.p_T_mm + 0.5 * even_gap_mm * place.outward_T);
    camera.X_HG.linear().col(0) = -on(place.outward_T);
    camera.X_HG.linear().col(1) = Eigen::Vector3d::UnitZ().cross(-on(place.outward_T));
    camera.X_HG.linear().col(2) = Eigen::Vector3d::UnitZ();
    Pose X_CG = Pose::Identity();
    X_CG.linear() = camera.scene.R_CG();
    X_CG.translation() = camera.scene.centre_C_mm();
    camera.scene.X_HC = camera.X_HG * X_CG.inverse();
    cameras.push_back(camera);
  }
  return cameras;
}

// The frame, straight at each place and even at identity, while it stands at X_HF.
inline GapScene seen(const PaneCamera& camera, const Pose& X_HF) {
  const Pose X_GF = camera.X_HG.inverse() * X_HF;
  const Eigen::Vector3d foot = X_GF * on(camera.place.p_T_mm + even_gap_mm * camera.place.outward_T);
  const Eigen::Vector3d outward = X_GF.linear() * on(camera.place.outward_T);
  GapScene scene = camera.scene;
  scene.frame_off_mm = -outward.dot(foot) / outward.x() - 0.5 * even_gap_mm;
  scene.frame_turn_rad = std::atan2(-outward.y(), -outward.x());
  return scene;
}

inline GapProblem wide_problem_of(const GapScene& scene) {
  GapProblem problem = problem_of(scene);
  problem.search.half_across_px = 80;
  return problem;
}

// The largest deviation of the true gaps from their middle.
inline double unevenness_mm(const std::vector<PaneCamera>& cameras, const Pose& X_HF) {
  double low = INFINITY, high = -INFINITY;
  for (const PaneCamera& camera : cameras) {
    const double off = seen(camera, X_HF).frame_off_mm;
    low = std::min(low, off), high = std::max(high, off);
  }
  return 0.5 * (high - low);
}

}  // namespace zeropose::test
