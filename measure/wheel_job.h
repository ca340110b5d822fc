// From the pictures of three stereo sensors to camber and toe of a wheel against zero, pure (spec 70,
// wheel-alignment).
#pragma once

#include <span>

#include "measure/measurement.h"

namespace zeropose {

// What the sensors see of the wheel. `zero` without a profile's radius: none was taken yet, the angles are
// then against the nominal wheel. Preconditions: the job has a wheel, whose cameras there are, each with an
// image of its size. X_WO is in the world; points and lines of the result are in the nominal wheel's frame.
WheelResult look_at_wheel(std::span<const CameraImage> images, const Job& job,
                          std::span<const CalibratedCamera> cameras, const Zero& zero);

// The rest of measure(), when cameras, images and zero are good. When the code is ok, X_O0O holds the shift
// of the wheel's centre and the turns camber (rx) and toe (ry); rz is 0. sigma_mm is that of the wheel's
// plane at the radius of the profile, pose.effective_marks counts the profile points.
//
// Codes: marks_invalid (numbers that make no sense), lines_not_found (lines, crossings or profile of a
// camera, named), deviation_not_attributable (pairs or profile points that contradict each other),
// limit_displacement (further from the nominal wheel than can be measured), sigma_too_large, and those of
// check_limits().
void measure_wheel_of(Measurement& measurement, const MeasurementProblem& problem);

// The mean of several exposures of the wheel as it should be. Codes: those above of an exposure, where half
// of them or more failed; deviation_not_attributable: the wheel moved meanwhile.
ZeroResult make_wheel_zero(const Job& job, std::span<const WheelResult> exposures);

// Whether the middle of the nominal side wall, at the angle of the camera's sensor, is in its image.
bool sees_its_side_wall(const Job& job, std::span<const CalibratedCamera> cameras, std::size_t camera);

// The lines that one camera of the job sees, put in order, for pictures. nullopt: no sensor has this camera,
// or it does not see its side wall.
std::optional<LineArrayResult> wheel_lines(const Job& job, std::span<const CalibratedCamera> cameras,
                                           std::size_t camera, const ImageView& image);

}  // namespace zeropose
