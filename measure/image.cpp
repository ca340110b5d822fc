#include "measure/image.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>

#include "measure/tally.h"

namespace zeropose {
namespace {

template <typename Pixel>
void copy_rows(const ImageView& image, const PixelWindow& window, float* __restrict out) {
  const auto scale = static_cast<float>(image.grey_per_count());
  const int width = window.width();
  for (int v = window.v0; v <= window.v1; ++v, out += width) {
    const Pixel* __restrict row = image.row<Pixel>(v) + window.u0;
    for (int i = 0; i < width; ++i) out[i] = scale * static_cast<float>(row[i]);
  }
}

// Every few rows, so that there are about 1500.
template <typename Pixel, typename Take>
int take_bends(const ImageView& image, const PixelWindow& window, const Take& take) {
  const int rows = std::max(1, 1500 / window.width()), stride = std::max(1, window.height() / rows);
  int count = 0;
  for (int v = window.v0; v <= window.v1; v += stride) {
    const Pixel* row = image.row<Pixel>(v);
    for (int u = window.u0 + 1; u < window.u1; ++u) take(std::abs(row[u - 1] - 2 * row[u] + row[u + 1]));
    count += std::max(0, window.width() - 2);
  }
  return count;
}

int median_bend_of_bytes(const ImageView& image, const PixelWindow& window) {
  Tally<511> bends;
  std::size_t turn = 0;
  const int count = take_bends<std::uint8_t>(image, window, [&](int bend) { bends.add(turn++, bend); });
  const auto histogram = bends.counts();
  int middle = 0;
  for (int sum = histogram[0]; 2 * sum < count && middle < 510;) sum += histogram[std::size_t(++middle)];
  return middle;
}

int median_bend_of_words(const ImageView& image, const PixelWindow& window) {
  std::vector<int> bends;
  take_bends<std::uint16_t>(image, window, [&](int bend) { bends.push_back(bend); });
  if (bends.empty()) return 0;
  const auto middle = bends.begin() + std::ptrdiff_t(bends.size() / 2);
  std::nth_element(bends.begin(), middle, bends.end());
  return *middle;
}

}  // namespace

double noise_grey(const ImageView& image, const PixelWindow& window) {
  const double rounding = image.grey_per_count() / std::sqrt(12.0);
  if (window.empty()) return rounding;
  const int bend =
      image.two_bytes() ? median_bend_of_words(image, window) : median_bend_of_bytes(image, window);
  // The median of |a - 2 b + c| is 0.6745 times its standard deviation, that is sqrt(6) times the noise.
  return std::max(rounding, image.grey_per_count() * bend / (0.6745 * std::sqrt(6.0)));
}

void copy_greys(const ImageView& image, const PixelWindow& window, std::vector<float>& greys) {
  greys.clear();
  if (window.empty()) return;
  greys.resize(static_cast<std::size_t>(window.width()) * static_cast<std::size_t>(window.height()));
  if (image.two_bytes()) {
    copy_rows<std::uint16_t>(image, window, greys.data());
  } else {
    copy_rows<std::uint8_t>(image, window, greys.data());
  }
}

}  // namespace zeropose
