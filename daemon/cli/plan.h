// The verb plan: what accuracy a cell's layout will give (spec 92).
#pragma once

#include <CLI/CLI.hpp>

namespace zeropose {

void add_plan(CLI::App& app, int& exit_status);

}  // namespace zeropose
