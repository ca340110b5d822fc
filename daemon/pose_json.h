// A pose on the control socket.
#pragma once

#include <nlohmann/json.hpp>

#include "calib/rigid.h"

namespace zeropose {

// [x, y, z, rx, ry, rz], mm and degrees.
inline nlohmann::json six_json(const Pose& X_AB) {
  const SixNumbers s = to_six_numbers(X_AB);
  return {s.x_mm, s.y_mm, s.z_mm, s.rx_deg, s.ry_deg, s.rz_deg};
}

}  // namespace zeropose
