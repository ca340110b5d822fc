// The verbs cameras list and cameras snapshot: the cameras of a line without a daemon.
#pragma once

#include "daemon/cli/verb.h"

namespace zeropose {

void add_cameras(cli::Verb app, int& exit_status);

}  // namespace zeropose
