// A borrowed look at the pixels of one frame.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace zeropose {

// Columns u0..u1 and rows v0..v1 of an image, inclusive; empty when u1 < u0 or v1 < v0.
struct PixelWindow {
  int u0 = 0, v0 = 0, u1 = -1, v1 = -1;

  bool empty() const { return u1 < u0 || v1 < v0; }
  int width() const { return u1 - u0 + 1; }
  int height() const { return v1 - v0 + 1; }
};

// Grey levels row by row. Does not own the pixels; pixel (0, 0) is the top-left one. Whatever the camera's
// depth, this room speaks of grey levels on the scale 0..255.
struct ImageView {
  const std::uint8_t* data = nullptr;
  int width_px = 0, height_px = 0;
  std::ptrdiff_t stride_bytes = 0;
  int white = 255;  // the highest value of a pixel; above 255 each has two bytes in the host's order

  bool two_bytes() const { return white > 255; }
  double grey_per_count() const { return 255.0 / white; }

  // Precondition: Pixel is std::uint16_t if two_bytes(), else std::uint8_t.
  template <typename Pixel = std::uint8_t>
  const Pixel* row(int v) const {
    return reinterpret_cast<const Pixel*>(data + v * stride_bytes);
  }

  double grey_at(int u, int v) const {
    return grey_per_count() * (two_bytes() ? row<std::uint16_t>(v)[u] : row(v)[u]);
  }
};

// The grey levels of a window, row by row. Precondition: the window lies in the image.
void copy_greys(const ImageView& image, const PixelWindow& window, std::vector<float>& greys);

// Standard deviation of the noise, grey levels, from second differences along some rows: their median, so
// that edges do not count as long as most of the window is flat. Never below that of the camera's own steps.
double noise_grey(const ImageView& image, const PixelWindow& window);

}  // namespace zeropose
