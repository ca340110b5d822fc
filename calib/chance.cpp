#include "calib/chance.h"

#include <cassert>
#include <cmath>

namespace zeropose {

// Q(a, y) with Q(a + 1, y) = Q(a, y) + y^a e^-y / Gamma(a + 1) from Q(1/2, y) = erfc(sqrt y), Q(1, y) = e^-y.
double chi_square_tail(double x, int degrees) {
  assert(degrees >= 1);
  if (!std::isfinite(x)) return 0;  // no number is no sign that all is well
  if (x <= 0) return 1;
  const double y = x / 2;
  double a = degrees % 2 == 0 ? 1 : 0.5;
  double tail = degrees % 2 == 0 ? std::exp(-y) : std::erfc(std::sqrt(y));
  for (; a < degrees / 2.0 - 0.25; ++a) tail += std::exp(a * std::log(y) - y - std::lgamma(a + 1));
  return tail;
}

// The incomplete beta function I_w(below / 2, above / 2) at w = below / (below + above x).
double fisher_tail(double x, int above, int below) {
  assert((above == 2 || above == 4) && below >= 1);
  if (!(x > 0)) return 1;
  const double half = below / 2.0, w = below / (below + above * x);
  return std::pow(w, half) * (above == 2 ? 1 : 1 + half * (1 - w));
}

}  // namespace zeropose
