// zeropose robot: what a robot sees of the daemon, and whether it understands it.
#pragma once

#include <CLI/CLI.hpp>

namespace zeropose {

void add_robot(CLI::App& app, int& exit_status);

}  // namespace zeropose
