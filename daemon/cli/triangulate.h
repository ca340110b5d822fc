// The verb triangulate: the places of points that several cameras see (spec 92).
#pragma once

#include "daemon/cli/verb.h"

namespace zeropose {

void add_triangulate(cli::Verb app, int& exit_status);

}  // namespace zeropose
