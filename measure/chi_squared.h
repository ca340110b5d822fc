// The chance of large deviations.
#pragma once

#include <cmath>
#include <numbers>

namespace zeropose {

// The probability that a sum of `degrees` squared standard normal numbers is larger than `square`;
// degrees >= 1.
inline double chi_squared_tail(double square, int degrees) {
  const double half = square / 2;
  const bool odd = degrees % 2 == 1;
  double tail = odd ? std::erfc(std::sqrt(half)) : std::exp(-half);
  // Each two degrees more add one term, half^a / Gamma(a + 1) e^-half.
  double term = odd ? 2 * std::sqrt(half / std::numbers::pi) * std::exp(-half) : half * std::exp(-half);
  for (int d = odd ? 3 : 4; d <= degrees; d += 2) {
    tail += term;
    term *= half / (d / 2.0);
  }
  return tail;
}

}  // namespace zeropose
