#include "measure/correction.h"

#include <limits>

namespace zeropose {

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
