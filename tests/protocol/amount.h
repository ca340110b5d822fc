// How often a test repeats itself: the whole number in ordinary builds, a part of it under a sanitizer, which
// looks for other things and takes twenty times as long.
#pragma once

#include <cstddef>

namespace zeropose {

constexpr std::size_t amount(std::size_t whole) {
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
  return whole / 25;
#else
  return whole;
#endif
}

}  // namespace zeropose
