// The verbs cameras stream and cameras test: cameras at work, without a daemon.
#pragma once

#include "daemon/cli/verb.h"

namespace zeropose {

void add_cameras_run(cli::Verb cameras, int& exit_status);

}  // namespace zeropose
