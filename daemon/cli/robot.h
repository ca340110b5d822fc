// zeropose robot: what a robot sees of the daemon, and whether it understands it.
#pragma once

#include "daemon/cli/verb.h"

namespace zeropose {

void add_robot(cli::Verb app, int& exit_status);

}  // namespace zeropose
