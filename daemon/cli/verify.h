// The verb verify: a cell against another measuring system (spec 92).
#pragma once

#include "daemon/cli/verb.h"

namespace zeropose {

void add_verify(cli::Verb app, int& exit_status);

}  // namespace zeropose
