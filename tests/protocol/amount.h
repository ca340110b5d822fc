// How often a test repeats itself: the whole number in ordinary builds, a part of it under a sanitizer, which
// looks for other things and takes twenty times as long.
#pragma once

#include <cstddef>

#include "tests/support/sanitized.h"

namespace zeropose {

inline std::size_t amount(std::size_t whole) { return test::sanitized() ? whole / 25 : whole; }

}  // namespace zeropose
