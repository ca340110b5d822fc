// The normal distribution of one and of two variables, for models of blurred edges. Internal to the room.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <numbers>

namespace zeropose {

struct NormalBell {
  float density, below;
};

// Good to 1e-6 for the density and 1e-5 for the integral (Abramowitz and Stegun 26.2.17); free of branches,
// so that the compiler turns the loop round it into vector code, for the processor of the caller.
[[gnu::always_inline]] inline NormalBell normal_bell(float t) {
  const float size = std::min(std::abs(t), 5.0F);
  const float y = size * size * (-0.5F / 32);
  float e = 1 + y * (1 + y * (1.0F / 2) * (1 + y * (1.0F / 3) * (1 + y * (1.0F / 4) * (1 + y * (1.0F / 5)))));
  e *= e, e *= e, e *= e, e *= e, e *= e;
  const float density = 0.398942280F * e, k = 1 / (1 + 0.2316419F * size);
  const float tail =
      density * k *
      (0.319381530F + k * (-0.356563782F + k * (1.781477937F + k * (-1.821255978F + k * 1.330274429F))));
  return {density, t < 0 ? tail : 1 - tail};
}

// Density of two standard normal variables with correlation rho, |rho| < 1.
inline double binormal_density(double h, double k, double rho) {
  const double q2 = 1 - rho * rho;
  return std::exp(-0.5 * (h * h - 2 * rho * h * k + k * k) / q2) / (2 * std::numbers::pi * std::sqrt(q2));
}

// P(X < h, Y < k) - P(X < h) P(Y < k) for one correlation: the density integrated over the correlation from 0
// (Plackett 1954), by Gauss-Legendre over its arc sine (Drezner and Wesolowsky 1990) with six points, twelve
// beyond 0.4. Good to 1e-6 for |rho| < 0.9.
class BinormalExcess {
 public:
  explicit BinormalExcess(double rho) : count_(std::abs(rho) < 0.4 ? 6 : 12) {
    constexpr std::array<double, 9> place{0.2386191861, 0.6612093865, 0.9324695142,
                                          0.1252334085, 0.3678314990, 0.5873179543,
                                          0.7699026742, 0.9041172564, 0.9815606342};
    constexpr std::array<double, 9> weight{0.4679139346, 0.3607615730, 0.1713244924,
                                           0.2491470458, 0.2334925365, 0.2031674267,
                                           0.1600783285, 0.1069393260, 0.0471753364};
    const double half = 0.5 * std::asin(rho);
    const std::size_t first = count_ == 6 ? 0 : 3;
    for (std::size_t i = 0; i < count_; ++i) {
      const std::size_t k = first + i / 2;
      const double s = std::sin(half * (1 + (i % 2 == 0 ? -place[k] : place[k])));
      nodes_[i] = {s, -0.5 / (1 - s * s), half * weight[k] / (2 * std::numbers::pi)};
    }
  }

  double operator()(double h, double k) const {
    const double squares = h * h + k * k, product = 2 * h * k;
    double sum = 0;
    for (std::size_t i = 0; i < count_; ++i) {
      sum += nodes_[i].weight * std::exp((squares - product * nodes_[i].sine) * nodes_[i].scale);
    }
    return sum;
  }

 private:
  struct Node {
    double sine, scale, weight;
  };
  std::size_t count_;
  std::array<Node, 12> nodes_{};
};

}  // namespace zeropose
