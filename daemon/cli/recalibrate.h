// zeropose recalibrate (spec 60, 92).
#pragma once

#include <CLI/CLI.hpp>

namespace zeropose {

// Adds the verb; exit_status as in batch.h.
void add_recalibrate(CLI::App& app, int& exit_status);

}  // namespace zeropose
