// Levenberg-Marquardt on the pixels (spec 50 M3). Internal to the room: use measure/pose.h.
#pragma once

#include "measure/pose_model.h"

namespace zeropose {

// Beyond this the geometry leaves a direction open: one camera that sees marks 1000 times closer to each
// other than to itself stays below 1e8.
inline constexpr double max_pose_condition = 1e10;

// singular: already at the start the observations leave a direction open.
enum class SolverStatus { failed = 0, converged, no_image, not_converged, singular };

struct Solution {
  SolverStatus status = SolverStatus::failed;
  CentredPose pose;
  NormalEquations equations;
};

// Minimises the cost of the active observations from a start. The model is left linearised at the solution,
// all observations.
Solution refine(PoseModel& model, const CentredPose& start);

}  // namespace zeropose
