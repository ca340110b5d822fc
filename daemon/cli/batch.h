// The verbs that need no running daemon: check-config, pose, bestfit, triangulate, calibrate, recalibrate,
// convert, find, find-board, plan (spec 92).
#pragma once

#include "daemon/cli/verb.h"

namespace zeropose {

// Adds the verbs; the one that is called sets exit_status: 0 done, 1 the input cannot give an answer, 2 wrong
// usage or unreadable input. With --json exactly one object goes to stdout; messages always go to stderr.
void add_batch_verbs(cli::Verb app, int& exit_status);

}  // namespace zeropose
