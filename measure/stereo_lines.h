// Points of a line of light that both cameras of a stereo sensor see. Internal to the room.
#pragma once

#include "calib/camera_model.h"
#include "measure/light_lines.h"
#include "measure/wheel_axis.h"

namespace zeropose {

// For every centre of the left line the point in W where its plane through both cameras' centres cuts the
// right line between two neighbouring centres: rays that meet, so that triangulate() gives the same point.
// Centres whose plane cuts the right line nowhere, in a gap of it, or twice have no point.
SideLine points_on_line(const CalibratedCamera& left, const LightLine& left_line,
                        const CalibratedCamera& right, const LightLine& right_line);

}  // namespace zeropose
