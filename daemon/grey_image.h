// A picture file as the grey levels that the measuring room takes.
#pragma once

#include <cstdint>
#include <filesystem>
#include <vector>

#include "measure/image.h"

namespace zeropose {

struct GreyImage {
  int width_px = 0, height_px = 0;
  std::vector<std::uint8_t> grey;   // rows without gaps
  std::vector<std::uint16_t> deep;  // instead of it where a pixel has two bytes
  int white = 255;

  ImageView view() const {
    if (deep.empty()) return {grey.data(), width_px, height_px, width_px};
    return {reinterpret_cast<const std::uint8_t*>(deep.data()), width_px, height_px, 2 * width_px, white};
  }
};

// 8 bit as they are, colour as its luminance, 16 bit with their range (but for one pixel in ten thousand at
// both ends) spread to 0..250. Throws ConfigError that names the file: missing, too large, no picture.
GreyImage load_grey_image(const std::filesystem::path& path);

// The same, but 16 bit as they are: white is the highest value of the least number of bits, from nine, that
// holds all pixels, without the low bits that no pixel uses.
GreyImage load_deep_image(const std::filesystem::path& path);

}  // namespace zeropose
