// A picture file as the grey levels that the measuring room takes.
#pragma once

#include <cstdint>
#include <filesystem>
#include <vector>

#include "measure/image.h"

namespace zeropose {

struct GreyImage {
  int width_px = 0, height_px = 0;
  std::vector<std::uint8_t> grey;

  ImageView view() const { return {grey.data(), width_px, height_px, width_px}; }
};

// 8 bit as they are, colour as its luminance, 16 bit with their range (but for one pixel in ten thousand at
// both ends) spread to 0..250. Throws ConfigError that names the file: missing, too large, no picture.
GreyImage load_grey_image(const std::filesystem::path& path);

}  // namespace zeropose
