// A borrowed look at the pixels of one frame.
#pragma once

#include <cstddef>
#include <cstdint>

namespace zeropose {

// Grey levels, 8 bit, row by row. Does not own the pixels; pixel (0, 0) is the top-left one.
struct ImageView {
  const std::uint8_t* data = nullptr;
  int width_px = 0, height_px = 0;
  std::ptrdiff_t stride_bytes = 0;

  const std::uint8_t* row(int v) const { return data + v * stride_bytes; }
};

}  // namespace zeropose
