// zeropose robot test: the guided convention check of one robot.
#pragma once

#include <CLI/CLI.hpp>

namespace zeropose {

void add_robot_check(CLI::App& robot, int& exit_status);

}  // namespace zeropose
