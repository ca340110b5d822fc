// A picture file as the grey levels that it holds, and a frame as a picture file.
#pragma once

#include <cstdint>
#include <optional>
#include <string_view>
#include <vector>

#include "drivers/camera.h"

namespace zeropose {

struct StoredPicture {
  int width_px = 0, height_px = 0;
  int white = 255;                   // the highest grey value; above 255 each pixel has two bytes, host order
  std::vector<std::uint8_t> pixels;  // rows without gaps
};

// What the bytes of a PNG, TIFF, BMP, PGM or JPEG file show, 8 or 16 bit, colour as its luminance; nullopt:
// no such picture. Of 16 bit, white is the highest value of the least number of bits, from nine, that holds
// all pixels, without the low bits that no pixel uses.
std::optional<StoredPicture> decode_picture(std::string_view bytes);

// The bytes of a PNG file with the grey values as they are, 16 bit where a pixel has two bytes.
std::vector<std::uint8_t> encode_png(const Frame& frame);

}  // namespace zeropose
