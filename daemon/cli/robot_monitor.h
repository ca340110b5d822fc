// zeropose robot monitor: a robot's result block, decoded, as it changes.
#pragma once

#include "daemon/cli/verb.h"

namespace zeropose {

void add_robot_monitor(cli::Verb robot, int& exit_status);

}  // namespace zeropose
