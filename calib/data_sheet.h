// Internals as a lens' data sheet states them (spec 20).
#pragma once

#include "calib/camera_model.h"

namespace zeropose {

struct DataSheet {
  double f_mm = 0;                                                  // focal length
  double sx_mm = 0, sy_mm = 0;                                      // pixel pitch
  double k_per_mm2 = 0;                                             // K / f^2, 0 for Brown-Conrady
  Eigen::Vector2d origin_from_centre_px = Eigen::Vector2d::Zero();  // C - size / 2, as the source prints it
};

// Only fx and fy can be estimated: the pitch along the rows' direction (Sy) is taken from the chip's data
// sheet.
DataSheet data_sheet(const CameraModel& camera, double sy_mm);

}  // namespace zeropose
