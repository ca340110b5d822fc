// The correction for one robot (spec 50 M7).
#pragma once

#include "calib/rigid.h"

namespace zeropose {

// Numbers as on the wire (spec 80).
enum class CorrectionFrame {
  none = 0,
  object_zero = 1,
  world_shift = 2,
  robot_base_shift = 3,
  user_frame = 4
};

// What carries the base of a robot along a straight line (spec 50 M7).
struct LinearAxis {
  Eigen::Vector3d direction_W = Eigen::Vector3d::UnitX();  // unit vector, towards growing positions
  double zero_mm = 0;                                      // the axis' position at which X_WR was taught
};

// X_WR(e): the base at the axis' position e, moved along the axis from where it was taught.
Pose base_at(const LinearAxis& axis, const Pose& X_WR_taught, double position_mm);

// object_zero: X_O0O. world_shift: D_W = X_WO X_WO0^-1. robot_base_shift: D_R = X_WR^-1 D_W X_WR. user_frame:
// X_RO.
Pose correction(CorrectionFrame frame, const Pose& X_WR, const Pose& X_WO0, const Pose& X_WO);

}  // namespace zeropose
