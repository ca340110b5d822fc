// What a calibration holds takes its value from the start. Internal to the room.
#pragma once

#include "calib/calibration.h"

namespace zeropose {

// A linear method's camera in the lens model asked for, with the held internals of the start; what is held
// without a start: the origin at origin_px, the lens at 0.
CameraModel with_held_values(const CalibrationProblem& problem, CameraModel model,
                             const Eigen::Vector2d& origin_px);

// The pose with those of its six numbers that are held.
Pose with_held_pose(const CalibrationProblem& problem, const Pose& X_WC);

}  // namespace zeropose
