#include "measure/correction.h"

#include <limits>

namespace zeropose {

Pose base_at(const LinearAxis& axis, const Pose& X_WR_taught, double position_mm) {
  Pose X_WR = X_WR_taught;
  X_WR.translation() += (position_mm - axis.zero_mm) * axis.direction_W;
  return X_WR;
}

Pose correction(CorrectionFrame frame, const Pose& X_WR, const Pose& X_WO0, const Pose& X_WO) {
  const Pose D_W = X_WO * X_WO0.inverse();
  switch (frame) {
    case CorrectionFrame::object_zero:
      return X_WO0.inverse() * X_WO;
    case CorrectionFrame::world_shift:
      return D_W;
    case CorrectionFrame::robot_base_shift:
      return X_WR.inverse() * D_W * X_WR;
    case CorrectionFrame::user_frame:
      return X_WR.inverse() * X_WO;
    case CorrectionFrame::none:
      break;
  }
  Pose nothing;
  nothing.matrix().setConstant(std::numeric_limits<double>::quiet_NaN());
  return nothing;
}

}  // namespace zeropose
