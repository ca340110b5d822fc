// zeropose find: marks in a picture.
#pragma once

#include <CLI/App.hpp>

namespace zeropose {

void add_find(CLI::App& app, int& exit_status);

}  // namespace zeropose
