#include "drivers/v4l2_pixels.h"

#include <opencv2/imgcodecs.hpp>

namespace zeropose {
namespace {

// Begins and ends as a JPEG picture must. The decoder would fill what is missing with grey and say nothing.
bool is_whole_jpeg(std::span<const std::uint8_t> bytes) {
  std::size_t end = bytes.size();
  while (end > 0 && bytes[end - 1] == 0) --end;
  return end >= 4 && bytes[0] == 0xff && bytes[1] == 0xd8 && bytes[end - 2] == 0xff && bytes[end - 1] == 0xd9;
}

}  // namespace

std::vector<std::uint8_t> brightness_of_yuyv(std::span<const std::uint8_t> bytes, int width_px, int height_px,
                                             std::size_t stride_bytes) {
  const auto width = static_cast<std::size_t>(width_px), height = static_cast<std::size_t>(height_px);
  std::vector<std::uint8_t> pixels(width * height);
  for (std::size_t v = 0; v < height; ++v) {
    const std::uint8_t* from = bytes.data() + v * stride_bytes;
    std::uint8_t* to = pixels.data() + v * width;
    for (std::size_t u = 0; u < width; ++u) to[u] = from[2 * u];
  }
  return pixels;
}

std::optional<DecodedJpeg> decode_jpeg(std::span<const std::uint8_t> bytes) {
  if (!is_whole_jpeg(bytes)) return std::nullopt;
  const cv::Mat packed(1, static_cast<int>(bytes.size()), CV_8UC1, const_cast<std::uint8_t*>(bytes.data()));
  cv::Mat grey;
  try {
    grey = cv::imdecode(packed, cv::IMREAD_GRAYSCALE);
  } catch (const cv::Exception&) {
    return std::nullopt;
  }
  if (grey.empty() || !grey.isContinuous()) return std::nullopt;
  return DecodedJpeg{grey.cols, grey.rows, {grey.datastart, grey.dataend}};
}

}  // namespace zeropose
