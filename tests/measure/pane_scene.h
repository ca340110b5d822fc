// A pane with gaps round it in a frame of straight pieces, by exact geometry.
#pragma once

#include <cmath>
#include <vector>

#include "measure/gap_evening.h"

namespace zeropose::test {

inline constexpr double degree = 1 / degrees_per_radian;

// Six places round a pane of 1200 x 700 mm whose corner, not its middle, is nearly the origin of its frame.
inline std::vector<PaneGap> pane_gaps(double gap_mm = 4) {
  const auto at = [gap_mm](const char* name, Eigen::Vector2d p, Eigen::Vector2d n) {
    return PaneGap{name, p, n.normalized(), gap_mm, 0.01, 1, 0};
  };
  return {at("top1", {250, 700}, {0.02, 1}), at("top2", {960, 698}, {-0.05, 1}),
          at("left", {0, 380}, {-1, 0.08}),  at("right", {1200, 320}, {1, 0.04}),
          at("low1", {240, 0}, {0, -1}),     at("low2", {980, 5}, {0.03, -1})};
}

inline EveningProblem problem_of(const std::vector<PaneGap>& gaps) {
  EveningProblem problem;
  problem.gaps = gaps;
  problem.tolerance_mm = 1e-6;
  problem.max_x_mm = problem.max_y_mm = 20;
  problem.max_rz_rad = 3 * degree;
  return problem;
}

inline Pose in_plane(double x_mm, double y_mm, double rz_rad) {
  return Eigen::Translation3d(x_mm, y_mm, 0) * Eigen::AngleAxisd(rz_rad, Eigen::Vector3d::UnitZ());
}

inline Eigen::Vector3d on(const Eigen::Vector2d& p) { return {p.x(), p.y(), 0}; }

// A frame of straight pieces, each a gap of gap_mm beside the pane at identity. The gap is looked at along
// the pane's own outward direction: exact geometry, nothing linear.
class Frame {
 public:
  explicit Frame(const std::vector<PaneGap>& pane) : pane_(pane) {}

  void move(const Pose& X) { X_WF_ = X * X_WF_; }
  std::vector<PaneGap> seen(const Pose& X_WT) const {
    std::vector<PaneGap> gaps = pane_;
    for (PaneGap& gap : gaps) {
      const Eigen::Vector3d foot = X_WF_ * on(gap.p_T_mm + gap.gap_mm * gap.outward_T);
      const Eigen::Vector3d normal = X_WF_.linear() * on(gap.outward_T);
      gap.gap_mm = normal.dot(foot - X_WT * on(gap.p_T_mm)) / normal.dot(X_WT.linear() * on(gap.outward_T));
    }
    return gaps;
  }

 private:
  std::vector<PaneGap> pane_;
  Pose X_WF_ = Pose::Identity();
};

inline double spread_of(const std::vector<PaneGap>& gaps) {
  double low = INFINITY, high = -INFINITY;
  for (const PaneGap& gap : gaps) low = std::min(low, gap.gap_mm), high = std::max(high, gap.gap_mm);
  return high - low;
}

// Where a place of the pane goes.
inline Eigen::Vector3d way_of(const EveningResult& result, const Eigen::Vector2d& p) {
  return result.X_TTn * on(p) - on(p);
}

// The frame moved by that.
inline void widen(std::vector<PaneGap>& gaps, double x_mm, double y_mm, double rz_rad) {
  Frame frame(gaps);
  frame.move(in_plane(x_mm, y_mm, rz_rad));
  gaps = frame.seen(Pose::Identity());
}

}  // namespace zeropose::test
