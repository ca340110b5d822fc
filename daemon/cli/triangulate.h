// The verb triangulate: the places of points that several cameras see (spec 92).
#pragma once

#include <CLI/CLI.hpp>

namespace zeropose {

void add_triangulate(CLI::App& app, int& exit_status);

}  // namespace zeropose
