// Where moved cameras are now, on the control socket.
#pragma once

#include <nlohmann/json.hpp>

#include "config/cell.h"
#include "measure/proposal.h"

namespace zeropose {

// {"cameras": [{"camera", "method", "status", "reason", "X_WC_before", "X_WC", "X_CoCn", "sigma": mm and
// degrees of X_WC, "rms_px", "deviations": [{"point", "dev_px", "used"}], "warnings"}], "effect":
// {"believed": {"code", "name", "reason", "X_O0O"}, "proposed": likewise or null}}; what there is no answer
// for is null. null: nothing is proposed.
nlohmann::json proposal_json(const Proposal& proposal, const Cell& cell);

}  // namespace zeropose
