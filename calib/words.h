// Numbers in the sentences that say why an input or a result does not count.
#pragma once

#include <cstdio>
#include <string>

namespace zeropose {

// With so many decimals; very large and very small numbers with an exponent.
inline std::string number(double value, int decimals = 2) {
  char text[64];
  const double size = value < 0 ? -value : value;
  const bool plain = size == 0 || (size >= 1e-3 && size < 1e6);
  std::snprintf(text, sizeof text, plain ? "%.*f" : "%.*e", decimals, value);
  return text;
}

inline std::string number(std::size_t value) { return std::to_string(value); }
inline std::string number(int value) { return std::to_string(value); }

}  // namespace zeropose
