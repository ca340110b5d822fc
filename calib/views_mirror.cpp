#include "calib/views_start.h"

namespace zeropose::bundle {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

Matrix3d half_turn(const Vector3d& axis) {
  return 2 * axis * axis.transpose() / axis.squaredNorm() - Matrix3d::Identity();
}

// The normal turned half about the line of sight, the board half about its normal: the outlines stay where
// they are as far as there is no perspective.
Pose mirrored(const Pose& X_CB, const BestPlane& plane) {
  const Vector3d centre = X_CB * plane.X_GP.translation();
  Pose X_CB2 = Pose::Identity();
  X_CB2.linear() = half_turn(centre) * X_CB.linear() * half_turn(plane.X_GP.linear().col(2));
  X_CB2.translation() = centre - X_CB2.linear() * plane.X_GP.translation();
  return X_CB2;
}

std::optional<Pose> better_mirrored(const State& state, const Chunk& chunk, double loss) {
  std::vector<Vector3d> points;
  for (const SeenPoint& point : chunk.points) points.push_back(point.p_B_mm);
  const BestPlane plane = best_plane(points);
  if (plane.flatness() > flat) return std::nullopt;
  State other = state;
  const Pose& X_WC = state.X_WC[chunk.camera];
  other.X_WB[chunk.view] = X_WC * mirrored(X_WC.inverse() * state.X_WB[chunk.view], plane);
  const std::span<const Chunk> own(&chunk, 1);
  const double cost = cost_of(state, own, loss);
  // With clear perspective the mirrored pose is far off and no refinement brings it back.
  if (!(cost_of(other, own, loss) < 4 * cost)) return std::nullopt;
  Freedom only{std::vector<Eigen::MatrixXd>(state.models.size(), Eigen::MatrixXd(internals_count, 0)),
               std::vector<bool>(state.models.size(), false), std::vector<bool>(state.X_WB.size(), false)};
  only.views[chunk.view] = true;
  refine(other, own, only, {loss, trial_iterations, {}});
  if (!(cost_of(other, own, loss) < 0.99 * cost)) return std::nullopt;
  return other.X_WB[chunk.view];
}

}  // namespace

bool turn_mirrored_views(const ViewsProblem& problem, State& state, std::span<const Chunk> chunks,
                         double loss) {
  std::vector<int> cameras_of_view(problem.views.size(), 0);
  for (const Chunk& chunk : chunks) ++cameras_of_view[chunk.view];
  bool turned = false;
  for (const Chunk& chunk : chunks) {
    // Two cameras see which of the two poses is right.
    if (problem.views[chunk.view].X_WB || cameras_of_view[chunk.view] != 1) continue;
    const auto X_WB = better_mirrored(state, chunk, loss);
    if (X_WB) state.X_WB[chunk.view] = *X_WB;
    turned = turned || X_WB.has_value();
  }
  return turned;
}

}  // namespace zeropose::bundle
