// zeropose calibrate views (spec 92).
#pragma once

#include <CLI/CLI.hpp>

namespace zeropose {

// Adds the verb to its parent `calibrate`; exit_status as in batch.h.
void add_calibrate_views(CLI::App& calibrate, int& exit_status);

}  // namespace zeropose
