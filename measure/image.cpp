#include "measure/image.h"

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

}  // namespace

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
