// The verbs cameras stream and cameras test: cameras at work, without a daemon.
#pragma once

#include <CLI/CLI.hpp>

namespace zeropose {

void add_cameras_run(CLI::App& cameras, int& exit_status);

}  // namespace zeropose
