// The verb find-board: a picture of a calibration board to points (spec 92).
#pragma once

#include "daemon/cli/verb.h"

namespace zeropose {

void add_find_board(cli::Verb app, int& exit_status);

}  // namespace zeropose
