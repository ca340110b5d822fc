// The verb verify: a cell against another measuring system (spec 92).
#pragma once

#include <CLI/CLI.hpp>

namespace zeropose {

void add_verify(CLI::App& app, int& exit_status);

}  // namespace zeropose
