// The verb find: marks in a picture (spec 92).
#pragma once

#include "daemon/cli/verb.h"

namespace zeropose {

void add_find(cli::Verb app, int& exit_status);

}  // namespace zeropose
