// Deviations of a calibration, what its options may not say, and what its result should be told with.
// Internal to the room.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "calib/calibration.h"
#include "calib/point_layout.h"

namespace zeropose {

// Found minus projected, a disc's eccentricity taken into account; where a point has no image not a number.
std::vector<CalibrationDeviation> deviations_of(std::span<const CalibrationPoint> points,
                                                const CameraModel& camera, const Pose& X_WC);
double rms_of(const std::vector<CalibrationDeviation>& deviations);

std::optional<InputFault> options_fault(const CalibrationProblem& problem);

// What the verdict (verdict.h) does not judge: units, repetitions, sizes, what one plane leaves open.
void add_warnings(const CalibrationProblem& problem, const PointLayout& layout, CalibrationResult& result);

}  // namespace zeropose
