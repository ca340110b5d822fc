// The verb find: marks in a picture (spec 92).
#pragma once

#include <CLI/CLI.hpp>

namespace zeropose {

void add_find(CLI::App& app, int& exit_status);

}  // namespace zeropose
