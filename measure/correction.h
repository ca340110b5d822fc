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

// object_zero: X_O0O. world_shift: D_W = X_WO X_WO0^-1. robot_base_shift: D_R = X_WR^-1 D_W X_WR. user_frame:
// X_RO.
Pose correction(CorrectionFrame frame, const Pose& X_WR, const Pose& X_WO0, const Pose& X_WO);

}  // namespace zeropose
