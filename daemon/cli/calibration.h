// The verb `zeropose calibration`: which calibration a cell has, putting a new one in its place, and going
// back.
#pragma once

#include "daemon/cli/verb.h"

namespace zeropose {

// Adds the verb; exit_status as in batch.h.
void add_calibration(cli::Verb app, int& exit_status);

}  // namespace zeropose
