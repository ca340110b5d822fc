#include "tests/support/block_compression.h"

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

namespace zeropose::test {
namespace {

using Block = Eigen::Matrix<double, 8, 8>;

constexpr std::array<int, 64> luminance_steps{
    16, 11, 10, 16, 24,  40,  51,  61,  12, 12, 14, 19, 26,  58,  60,  55,  //
    14, 13, 16, 24, 40,  57,  69,  56,  14, 17, 22, 29, 51,  87,  80,  62,  //
    18, 22, 37, 56, 68,  109, 103, 77,  24, 35, 55, 64, 81,  104, 113, 92,  //
    49, 64, 78, 87, 103, 121, 120, 101, 72, 92, 95, 98, 112, 100, 103, 99};

Block cosines() {
  Block transform;
  for (int k = 0; k < 8; ++k) {
    for (int x = 0; x < 8; ++x) {
      transform(k, x) = (k == 0 ? std::sqrt(0.125) : 0.5) * std::cos((2 * x + 1) * k * std::numbers::pi / 16);
    }
  }
  return transform;
}

Block steps_of(int quality) {
  const int scale = quality < 50 ? 5000 / quality : 200 - 2 * quality;
  Block steps;
  for (int k = 0; k < 64; ++k) {
    steps(k / 8, k % 8) =
        std::clamp((luminance_steps[static_cast<std::size_t>(k)] * scale + 50) / 100, 1, 255);
  }
  return steps;
}

}  // namespace

void compress_and_expand(std::vector<std::uint8_t>& grey, int width_px, int height_px, int quality) {
  const Block transform = cosines(), steps = steps_of(quality);
  const auto at = [&](int u, int v) -> std::uint8_t& {
    return grey[static_cast<std::size_t>(v) * static_cast<std::size_t>(width_px) +
                static_cast<std::size_t>(u)];
  };
  for (int v0 = 0; v0 < height_px; v0 += 8) {
    for (int u0 = 0; u0 < width_px; u0 += 8) {
      Block block;
      for (int k = 0; k < 64; ++k) {
        block(k / 8, k % 8) =
            at(std::min(u0 + k % 8, width_px - 1), std::min(v0 + k / 8, height_px - 1)) - 128.0;
      }
      const Block spectrum = transform * block * transform.transpose();
      const Block rounded = spectrum.cwiseQuotient(steps).array().round().matrix().cwiseProduct(steps);
      block = transform.transpose() * rounded * transform;
      for (int k = 0; k < 64; ++k) {
        if (u0 + k % 8 >= width_px || v0 + k / 8 >= height_px) continue;
        const double value = std::clamp(block(k / 8, k % 8) + 128.0, 0.0, 255.0);
        at(u0 + k % 8, v0 + k / 8) = static_cast<std::uint8_t>(std::lround(value));
      }
    }
  }
}

}  // namespace zeropose::test
