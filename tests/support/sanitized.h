// Under a sanitizer a program is ten times slower and statistics tell nothing new: what counts there is that
// every path is gone through.
#pragma once

// Of the sanitizers' libraries, where one is linked. Asked at run time: a test program's objects are those of
// the release build.
extern "C" [[gnu::weak]] void __asan_init();
extern "C" [[gnu::weak]] void __tsan_init();

namespace zeropose::test {

inline bool sanitized() { return __asan_init != nullptr || __tsan_init != nullptr; }

// How many of `count` like trials are made: all, or an eighth.
inline int trials(int count) { return sanitized() ? (count + 7) / 8 : count; }

}  // namespace zeropose::test
