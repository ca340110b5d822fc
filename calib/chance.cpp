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

namespace {

// The continued fraction of the incomplete beta function, by Lentz's method (Abramowitz and Stegun 26.5.8).
double beta_fraction(double a, double b, double x) {
  constexpr double tiny = 1e-300;
  double c = 1, d = 1 - (a + b) * x / (a + 1);
  d = 1 / (std::abs(d) > tiny ? d : tiny);
  double value = d;
  for (int m = 1; m < 500; ++m) {
    const double even = m * (b - m) * x / ((a + 2 * m - 1) * (a + 2 * m));
    const double odd = -(a + m) * (a + b + m) * x / ((a + 2 * m) * (a + 2 * m + 1));
    double factor = 1;
    for (const double term : {even, odd}) {
      d = 1 + term * d;
      c = 1 + term / c;
      d = 1 / (std::abs(d) > tiny ? d : tiny);
      if (std::abs(c) < tiny) c = tiny;
      factor = c * d;
      value *= factor;
    }
    if (std::abs(factor - 1) < 1e-15) break;
  }
  return value;
}

// I_x(a, b).
double incomplete_beta(double a, double b, double x) {
  if (x <= 0) return 0;
  if (x >= 1) return 1;
  const double front =
      std::exp(std::lgamma(a + b) - std::lgamma(a) - std::lgamma(b) + a * std::log(x) + b * std::log1p(-x));
  return x < (a + 1) / (a + b + 2) ? front * beta_fraction(a, b, x) / a
                                   : 1 - front * beta_fraction(b, a, 1 - x) / b;
}

// Where a tail, a falling function of x, is 5 %.
template <typename Tail>
double five_percent(const Tail& tail) {
  double low = 0, high = 1;
  while (tail(high) > 0.05) high *= 2;
  for (int round = 0; round < 60; ++round) (tail((low + high) / 2) > 0.05 ? low : high) = (low + high) / 2;
  return (low + high) / 2;
}

}  // namespace

// The incomplete beta function I_w(below / 2, above / 2) at w = below / (below + above x).
double fisher_tail(double x, int above, int below) {
  assert(above >= 1 && below >= 1);
  if (!(x > 0)) return 1;
  const double half = below / 2.0, w = below / (below + above * x);
  if (above == 2 || above == 4) return std::pow(w, half) * (above == 2 ? 1 : 1 + half * (1 - w));
  return incomplete_beta(half, above / 2.0, w);
}

double few_data_factor(int dimensions, int degrees) {
  assert(dimensions >= 1 && degrees >= 1);
  const double fisher = five_percent([&](double x) { return fisher_tail(x, dimensions, degrees); });
  return dimensions * fisher / five_percent([&](double x) { return chi_square_tail(x, dimensions); });
}

}  // namespace zeropose
