// zeropose robot test: the guided convention check of one robot.
#pragma once

#include "daemon/cli/verb.h"

namespace zeropose {

void add_robot_check(cli::Verb robot, int& exit_status);

}  // namespace zeropose
