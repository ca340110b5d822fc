// zeropose robot monitor: a robot's result block, decoded, as it changes.
#pragma once

#include <CLI/CLI.hpp>

namespace zeropose {

void add_robot_monitor(CLI::App& robot, int& exit_status);

}  // namespace zeropose
