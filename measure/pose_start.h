// Poses to start from when nothing is known: depth factors along the rays (spec 50 M3, M1). Internal to the
// room: use measure/pose.h.
#pragma once

#include <optional>
#include <vector>

#include "measure/pose_model.h"

namespace zeropose {

// Candidates for the pose of the active observations, best first, at most `count`, different from each other.
// Each is a local minimum of the sum of squared distances between the marks and their rays in W, with the
// depth factors eliminated in closed form; marks behind their camera rule a candidate out. nullopt when the
// directions of sight leave the position open (parallel, or too few).
std::optional<std::vector<CentredPose>> start_poses(const PoseModel& model, std::size_t count);

}  // namespace zeropose
