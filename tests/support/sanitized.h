// Under a sanitizer a program is ten times slower and statistics tell nothing new: what counts there is that
// every path is gone through.
#pragma once

namespace zeropose::test {

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
inline constexpr bool sanitized = true;
#else
inline constexpr bool sanitized = false;
#endif

// How many of `count` like trials are made: all, or an eighth.
constexpr int trials(int count) { return sanitized ? (count + 7) / 8 : count; }

}  // namespace zeropose::test
