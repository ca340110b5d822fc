// The verb `zeropose calibration`: which calibration a cell has, putting a new one in its place, and going
// back.
#pragma once

#include <CLI/CLI.hpp>

namespace zeropose {

// Adds the verb; exit_status as in batch.h.
void add_calibration(CLI::App& app, int& exit_status);

}  // namespace zeropose
