// Calibration of one camera or of a rig of cameras from several views of a board or body (spec 30,
// "Multi-image").
#pragma once

#include <cstddef>

#include "calib/calibration.h"

namespace zeropose {

// A point of the board (p_W_mm and disc_normal_W are in the board's frame B) as a camera saw it in a view.
struct ViewPoint {
  std::size_t view = 0, camera = 0;
  CalibrationPoint point;
};

}  // namespace zeropose
