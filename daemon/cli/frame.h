// The verb frame: a cell's world in a measuring system's frame (docs/body.md).
#pragma once

#include "daemon/cli/verb.h"

namespace zeropose {

void add_frame(cli::Verb app, int& exit_status);

}  // namespace zeropose
