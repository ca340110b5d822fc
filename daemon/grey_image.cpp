#include "daemon/grey_image.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "config/config_error.h"
#include "config/files.h"

namespace zeropose {
namespace {

// 255 is left to what is saturated, which 16 bit pictures of 10 or 12 bit cameras do not tell.
void to_8_bit(cv::Mat& picture) {
  std::vector<std::uint16_t> sorted(picture.begin<std::uint16_t>(), picture.end<std::uint16_t>());
  const std::size_t few = sorted.size() / 10000;
  const auto low = sorted.begin() + static_cast<std::ptrdiff_t>(few);
  const auto high = sorted.end() - 1 - static_cast<std::ptrdiff_t>(few);
  std::nth_element(sorted.begin(), low, sorted.end());
  const double lowest = *low;
  std::nth_element(sorted.begin(), high, sorted.end());
  const double scale = 250 / std::max(1.0, *high - lowest);
  picture.convertTo(picture, CV_8U, scale, -lowest * scale);
}

cv::Mat load_picture(const std::filesystem::path& path) {
  const std::string bytes = read_file(path);
  cv::Mat picture;
  try {
    picture =
        cv::imdecode(cv::Mat(1, static_cast<int>(bytes.size()), CV_8UC1, const_cast<char*>(bytes.data())),
                     cv::IMREAD_ANYDEPTH | cv::IMREAD_GRAYSCALE | cv::IMREAD_IGNORE_ORIENTATION);
  } catch (const cv::Exception&) {  // an empty file; the message below says it
  }
  if (picture.empty() || (picture.depth() != CV_8U && picture.depth() != CV_16U))
    throw ConfigError({path.string() + ": found no picture, expected PNG, JPEG, TIFF or PGM, 8 or 16 bit"});
  return picture;
}

GreyImage bytes_of(const cv::Mat& picture) {
  GreyImage image{picture.cols, picture.rows, {}, {}, 255};
  image.grey.assign(picture.begin<std::uint8_t>(), picture.end<std::uint8_t>());
  return image;
}

}  // namespace

GreyImage load_grey_image(const std::filesystem::path& path) {
  cv::Mat picture = load_picture(path);
  if (picture.depth() == CV_16U) to_8_bit(picture);
  return bytes_of(picture);
}

GreyImage load_deep_image(const std::filesystem::path& path) {
  const cv::Mat picture = load_picture(path);
  if (picture.depth() == CV_8U) return bytes_of(picture);
  GreyImage image{picture.cols, picture.rows, {}, {}, 511};
  image.deep.assign(picture.begin<std::uint16_t>(), picture.end<std::uint16_t>());
  int used = 0;  // bits that are set in some pixel
  for (const std::uint16_t value : image.deep) used |= value;
  while (image.white < used) image.white = 2 * image.white + 1;
  // Twelve bits at the upper end of sixteen are white at 4095 times 16. Eight are kept whatever the picture
  // shows.
  for (int lowest = 1; (used & lowest) == 0 && 2 * image.white >= 511 * lowest; lowest *= 2)
    image.white -= lowest;
  return image;
}

}  // namespace zeropose
