// A picture file as the grey levels that the measuring room takes.
#pragma once

#include <filesystem>

#include "drivers/picture_file.h"
#include "measure/image.h"

namespace zeropose {

ImageView view_of(const StoredPicture& picture);

// 8 bit as they are, colour as its luminance, 16 bit with their range (but for one pixel in ten thousand at
// both ends) spread to 0..250. Throws ConfigError that names the file: missing, too large, no picture.
StoredPicture load_grey_image(const std::filesystem::path& path);

// The same, but 16 bit as they are.
StoredPicture load_deep_image(const std::filesystem::path& path);

}  // namespace zeropose
