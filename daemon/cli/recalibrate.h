// zeropose recalibrate (spec 60, 92).
#pragma once

#include "daemon/cli/verb.h"

namespace zeropose {

// Adds the verb; exit_status as in batch.h.
void add_recalibrate(cli::Verb app, int& exit_status);

}  // namespace zeropose
