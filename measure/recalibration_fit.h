// The least squares behind recalibrate(). Internal to the room.
#pragma once

#include <optional>
#include <vector>

#include "calib/point_fit.h"
#include "measure/recalibration.h"

namespace zeropose {

// --- arbitrary points: R_CoCn, 3 unknowns

// The rotation that carries the new directions onto the old ones best, all alike.
Eigen::Matrix3d rotation_between(const RecalibrationProblem& problem);
PointFit fit_rotation(const RecalibrationProblem& problem, const Eigen::Matrix3d& R_CoCn_start);
Eigen::Matrix3d rotation_of(const PointFit& fit);  // precondition: from fit_rotation()

// --- groups: X_CoCn and X_CoG of every group, 6 + 6 n unknowns

struct GroupState {
  Pose X_CoCn = Pose::Identity();
  std::vector<Pose> X_CoG;  // by group
};
// The group of every point, numbered in the order in which they appear.
std::vector<std::size_t> group_numbers(std::span<const RecalibrationPoint> points);

PointFit fit_groups(const RecalibrationProblem& problem, const GroupState& start);
const GroupState& groups_of(const PointFit& fit);  // precondition: from fit_groups()

struct GroupFits {
  PointFit best;             // or what came nearest to one
  std::vector<Pose> others;  // X_CoCn of other fits that explain the pixels as well
};
// From every pose of the groups that three of their points allow.
GroupFits fit_groups_from_anywhere(const RecalibrationProblem& problem);

}  // namespace zeropose
