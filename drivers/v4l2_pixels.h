// From the bytes of a V4L2 buffer to grey levels, where they are not grey levels already.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

namespace zeropose {

// The brightness of pictures in YUYV order: every second byte. `stride_bytes` from one row to the next.
// Precondition: `bytes` holds all rows.
std::vector<std::uint8_t> brightness_of_yuyv(std::span<const std::uint8_t> bytes, int width_px, int height_px,
                                             std::size_t stride_bytes);

struct DecodedJpeg {
  int width_px = 0, height_px = 0;
  std::vector<std::uint8_t> pixels;
};
// The brightness of a JPEG picture; zeros behind its end are allowed. nullopt: it is no whole JPEG picture.
std::optional<DecodedJpeg> decode_jpeg(std::span<const std::uint8_t> bytes);

}  // namespace zeropose
