// zeropose calibrate views (spec 92).
#pragma once

#include "daemon/cli/verb.h"

namespace zeropose {

// Adds the verb to its parent `calibrate`; exit_status as in batch.h.
void add_calibrate_views(cli::Verb calibrate, int& exit_status);

}  // namespace zeropose
