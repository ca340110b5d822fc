// zeropose teach: the marks of a new object, from what a stereo sensor on a robot's hand saw (spec 50 M2,
// 70).
#pragma once

#include "daemon/cli/verb.h"

namespace zeropose {

void add_teach(cli::Verb app, int& exit_status);

}  // namespace zeropose
