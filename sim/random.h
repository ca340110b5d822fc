// Numbers drawn for a simulated cell: the same on every machine, unlike the distributions of <random>.
#pragma once

#include <cstdint>
#include <random>

namespace zeropose {

class Random {
 public:
  explicit Random(std::uint64_t seed) : engine_(seed) {}

  // Uniform in [0, 1): the upper 53 bits of one draw.
  double uniform() { return static_cast<double>(engine_() >> 11) * 0x1p-53; }
  double uniform(double from, double to) { return from + (to - from) * uniform(); }

  // Standard normal by Box and Muller: the cosine branch of two draws.
  double normal();

 private:
  std::mt19937_64 engine_;
};

}  // namespace zeropose
