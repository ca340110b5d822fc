// The verbs that ask a running daemon: status, measure, zero, snapshot.
#pragma once

#include "daemon/cli/verb.h"

namespace zeropose {

// Adds the verbs; the one that is called sets exit_status: 0 done, 1 not ok, 2 no daemon or wrong usage.
void add_live_verbs(cli::Verb app, int& exit_status);

}  // namespace zeropose
