// Wheels on the control socket.
#pragma once

#include <nlohmann/json.hpp>

#include "measure/wheel.h"

namespace zeropose {

// How far it came; the angles, their sigmas and the profile only where the status is ok.
nlohmann::json wheel_json(const WheelResult& wheel);

}  // namespace zeropose
