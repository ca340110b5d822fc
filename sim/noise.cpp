#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <numbers>

#include "sim/renderer.h"

namespace zeropose {
namespace {

constexpr std::size_t table_size = 4096;

// The standard normal deviate below which the share p of all lies: bisection of erfc, for the table only.
double normal_quantile(double p) {
  double low = -10, high = 10;
  for (int step = 0; step < 60; ++step) {
    const double middle = (low + high) / 2;
    (0.5 * std::erfc(-middle / std::numbers::sqrt2) < p ? low : high) = middle;
  }
  return (low + high) / 2;
}

// Equally likely normal deviates. The sum of two draws has variance 1 and is normal up to 5 sigma.
std::array<float, table_size> make_table() {
  std::array<double, table_size> deviates{};
  double square = 0;
  for (std::size_t i = 0; i < table_size; ++i) {
    deviates[i] = normal_quantile((static_cast<double>(i) + 0.5) / table_size);
    square += deviates[i] * deviates[i];
  }
  const double scale = std::sqrt(table_size / (2 * square));
  std::array<float, table_size> table{};
  for (std::size_t i = 0; i < table_size; ++i) table[i] = static_cast<float>(scale * deviates[i]);
  return table;
}

// SplitMix64 (Steele, Lea, Flood 2014).
std::uint64_t next(std::uint64_t& state) {
  std::uint64_t z = (state += 0x9E3779B97F4A7C15U);
  z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9U;
  z = (z ^ (z >> 27)) * 0x94D049BB133111EBU;
  return z ^ (z >> 31);
}

std::uint8_t to_grey(float value) {
  return static_cast<std::uint8_t>(static_cast<int>(std::clamp(value + 0.5F, 0.0F, 255.0F)));
}

}  // namespace

void add_noise(std::span<const float> clean, double sigma_grey, std::uint64_t& generator_state,
               std::span<std::uint8_t> pixels) {
  static const std::array<float, table_size> table = make_table();
  assert(clean.size() == pixels.size());
  const auto sigma = static_cast<float>(sigma_grey);
  const auto deviate = [&](std::uint64_t bits) {
    return table[bits & (table_size - 1)] + table[(bits >> 16) & (table_size - 1)];
  };
  for (std::size_t i = 0; i + 1 < clean.size(); i += 2) {
    const std::uint64_t bits = next(generator_state);
    pixels[i] = to_grey(clean[i] + sigma * deviate(bits));
    pixels[i + 1] = to_grey(clean[i + 1] + sigma * deviate(bits >> 32));
  }
  if (clean.size() % 2 == 1)
    pixels[clean.size() - 1] = to_grey(clean.back() + sigma * deviate(next(generator_state)));
}

}  // namespace zeropose
