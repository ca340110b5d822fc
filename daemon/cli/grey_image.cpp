#include "daemon/cli/grey_image.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "config/config_error.h"
#include "config/files.h"

namespace zeropose {
namespace {

// 255 is left to what is saturated, which 16 bit pictures of 10 or 12 bit cameras do not tell.
void to_8_bit(StoredPicture& picture) {
  std::vector<std::uint16_t> deep(picture.pixels.size() / 2);
  std::memcpy(deep.data(), picture.pixels.data(), picture.pixels.size());
  std::vector<std::uint16_t> sorted = deep;
  const std::size_t few = sorted.size() / 10000;
  const auto low = sorted.begin() + static_cast<std::ptrdiff_t>(few);
  const auto high = sorted.end() - 1 - static_cast<std::ptrdiff_t>(few);
  std::nth_element(sorted.begin(), low, sorted.end());
  const double lowest = *low;
  std::nth_element(sorted.begin(), high, sorted.end());
  const double scale = 250 / std::max(1.0, *high - lowest);
  picture.white = 255;
  picture.pixels.resize(deep.size());
  std::ranges::transform(deep, picture.pixels.begin(), [&](std::uint16_t value) {
    return static_cast<std::uint8_t>(std::clamp(std::lround(scale * (value - lowest)), 0L, 255L));
  });
}

}  // namespace

ImageView view_of(const StoredPicture& picture) {
  return {picture.pixels.data(), picture.width_px, picture.height_px,
          std::ptrdiff_t{picture.white > 255 ? 2 : 1} * picture.width_px, picture.white};
}

StoredPicture load_deep_image(const std::filesystem::path& path) {
  std::optional<StoredPicture> picture = decode_picture(read_file(path));
  if (!picture)
    throw ConfigError({path.string() + ": found no picture, expected PNG, JPEG, TIFF or PGM, 8 or 16 bit"});
  return std::move(*picture);
}

StoredPicture load_grey_image(const std::filesystem::path& path) {
  StoredPicture picture = load_deep_image(path);
  if (picture.white > 255) to_8_bit(picture);
  return picture;
}

}  // namespace zeropose
