// The verb network: a measuring system that was moved, all of its points in one frame (docs/body.md).
#pragma once

#include "daemon/cli/verb.h"

namespace zeropose {

void add_network(cli::Verb app, int& exit_status);

}  // namespace zeropose
