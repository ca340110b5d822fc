// Numbers no pose can be estimated from (spec 50 M3). Internal to the room: use measure/pose.h.
#pragma once

#include <string>

#include "measure/pose.h"

namespace zeropose {

// What is wrong with the numbers of a problem, or nothing.
std::string fault_of(const PoseProblem& problem);

}  // namespace zeropose
