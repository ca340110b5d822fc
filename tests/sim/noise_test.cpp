#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>

#include "sim/renderer.h"

namespace zeropose {
namespace {

constexpr std::size_t pixels = 768 * 572;

std::vector<std::uint8_t> noisy(const std::vector<float>& clean, double sigma, std::uint64_t& state) {
  std::vector<std::uint8_t> grey(clean.size());
  add_noise(clean, sigma, state, grey);
  return grey;
}

double normal_share_below(double x) { return 0.5 * std::erfc(-x / std::numbers::sqrt2); }

// Pearson's chi-square over all grey levels with at least ten expected pixels. Bound: exceeded by a normal
// source once in 10^6 (chi-square with k degrees of freedom, Wilson and Hilferty).
TEST(Noise, GreyLevelsAreNormallyDistributed) {
  constexpr double mean = 100.3, sigma = 2;
  std::uint64_t state = 7;
  std::map<int, double> count;
  for (const auto grey : noisy(std::vector<float>(pixels, static_cast<float>(mean)), sigma, state))
    count[grey] += 1;
  double chi_square = 0, k = -1;
  for (int grey = 80; grey <= 120; ++grey) {
    const double share =
        normal_share_below((grey + 0.5 - mean) / sigma) - normal_share_below((grey - 0.5 - mean) / sigma);
    const double expected = share * static_cast<double>(pixels);
    if (expected < 10) continue;
    chi_square += (count[grey] - expected) * (count[grey] - expected) / expected;
    k += 1;
  }
  EXPECT_GT(k, 12);
  EXPECT_LT(chi_square, k * std::pow(1 - 2 / (9 * k) + 4.75 * std::sqrt(2 / (9 * k)), 3));
}

// The variance of rounding to whole grey levels is 1/12 and adds; 5 sigma of a chi-square with n degrees.
TEST(Noise, HasTheSigmaAskedFor) {
  for (const double sigma : {1.0, 2.0, 5.0}) {
    std::uint64_t state = 11;
    double sum = 0, square = 0;
    for (const auto grey : noisy(std::vector<float>(pixels, 128.25F), sigma, state)) {
      sum += grey - 128.25;
      square += (grey - 128.25) * (grey - 128.25);
    }
    constexpr double n = pixels;
    const double variance = sigma * sigma + 1.0 / 12;
    EXPECT_LT(std::abs(sum / n), 5 * std::sqrt(variance / n)) << sigma;
    EXPECT_LT(std::abs(square / n / variance - 1), 5 * std::sqrt(2 / n)) << sigma;
  }
}

// Correlation of two independent rows of n numbers: sigma 1/sqrt(n).
double correlation(const std::vector<std::uint8_t>& a, std::size_t shift_a,
                   const std::vector<std::uint8_t>& b) {
  double product = 0, square = 0;
  for (std::size_t i = 0; i + shift_a < a.size(); ++i) {
    product += (a[i + shift_a] - 100.0) * (b[i] - 100.0);
    square += (b[i] - 100.0) * (b[i] - 100.0);
  }
  return product / square;
}

TEST(Noise, IsDrawnAnewForEveryPixelAndCall) {
  const std::vector<float> clean(pixels, 100.0F);
  std::uint64_t state = 1, other_state = 2;
  const auto first = noisy(clean, 2, state), second = noisy(clean, 2, state),
             other = noisy(clean, 2, other_state);
  const double bound = 5 / std::sqrt(static_cast<double>(pixels));
  EXPECT_LT(std::abs(correlation(first, 0, second)), bound);
  EXPECT_LT(std::abs(correlation(first, 0, other)), bound);
  for (const std::size_t shift : {1U, 2U, 3U, 4U, 768U})
    EXPECT_LT(std::abs(correlation(first, shift, first)), bound) << shift;
  EXPECT_GT(correlation(first, 0, first), 0.99);
}

TEST(Noise, TheSameStateGivesTheSameNoise) {
  const std::vector<float> clean(1001, 100.0F);
  std::uint64_t a = 5, b = 5;
  EXPECT_EQ(noisy(clean, 2, a), noisy(clean, 2, b));
  EXPECT_EQ(a, b);
  EXPECT_NE(a, 5U);
}

TEST(Noise, WithoutNoiseRoundsAndClamps) {
  std::uint64_t state = 1;
  EXPECT_EQ(noisy({-3.0F, 0.4F, 0.6F, 99.49F, 99.51F, 255.4F, 300.0F}, 0, state),
            (std::vector<std::uint8_t>{0, 0, 1, 99, 100, 255, 255}));
}

// What falls beyond the range, and half a grey level more, lands on its end.
TEST(Noise, ClampsAtBothEnds) {
  std::uint64_t state = 1;
  const auto dark = noisy(std::vector<float>(pixels, 0.0F), 20, state);
  const auto bright = noisy(std::vector<float>(pixels, 255.0F), 20, state);
  constexpr double n = pixels;
  const double expected = n * normal_share_below(0.5 / 20), five_sigma = 5 * std::sqrt(n / 4);
  EXPECT_NEAR(static_cast<double>(std::ranges::count(dark, 0)), expected, five_sigma);
  EXPECT_NEAR(static_cast<double>(std::ranges::count(bright, 255)), expected, five_sigma);
}

}  // namespace
}  // namespace zeropose
