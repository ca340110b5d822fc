// The verb frame: a cell's world in a measuring system's frame (docs/body.md).
#pragma once

#include <CLI/CLI.hpp>

namespace zeropose {

void add_frame(CLI::App& app, int& exit_status);

}  // namespace zeropose
