// The verb find-board: a picture of a calibration board to points (spec 92).
#pragma once

#include <CLI/CLI.hpp>

namespace zeropose {

void add_find_board(CLI::App& app, int& exit_status);

}  // namespace zeropose
