// The verb plan: what accuracy a cell's layout will give (spec 92).
#pragma once

#include "daemon/cli/verb.h"

namespace zeropose {

void add_plan(cli::Verb app, int& exit_status);

}  // namespace zeropose
