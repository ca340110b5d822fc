// The verbs cameras list and cameras snapshot: the cameras of a line without a daemon.
#pragma once

#include <CLI/CLI.hpp>

namespace zeropose {

void add_cameras(CLI::App& app, int& exit_status);

}  // namespace zeropose
