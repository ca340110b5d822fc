// Gaps on the control socket.
#pragma once

#include <nlohmann/json.hpp>

#include "config/cell.h"
#include "measure/measurement.h"

namespace zeropose {

// null where the measurement is not one of gaps. Else each gap of the job with what was found of it, and the
// motion that evens them, as far as it came to that.
nlohmann::json gaps_json(const Job& job, const Cell& cell, const Measurement& measurement);

}  // namespace zeropose
