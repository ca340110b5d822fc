#include "drivers/picture_file.h"

#include <cstring>
#include <opencv2/imgcodecs.hpp>

namespace zeropose {
namespace {

int white_of(const cv::Mat& deep) {
  int used = 0;  // bits that are set in some pixel
  for (auto value = deep.begin<std::uint16_t>(); value != deep.end<std::uint16_t>(); ++value) used |= *value;
  int white = 511;
  while (white < used) white = 2 * white + 1;
  // Twelve bits at the upper end of sixteen are white at 4095 times 16. Eight are kept whatever the picture
  // shows.
  for (int lowest = 1; (used & lowest) == 0 && 2 * white >= 511 * lowest; lowest *= 2) white -= lowest;
  return white;
}

cv::Mat decoded(std::string_view bytes) {
  try {
    return cv::imdecode(cv::Mat(1, static_cast<int>(bytes.size()), CV_8UC1, const_cast<char*>(bytes.data())),
                        cv::IMREAD_ANYDEPTH | cv::IMREAD_GRAYSCALE | cv::IMREAD_IGNORE_ORIENTATION);
  } catch (const cv::Exception&) {  // an empty file
    return {};
  }
}

}  // namespace

std::optional<StoredPicture> decode_picture(std::string_view bytes) {
  const cv::Mat picture = decoded(bytes);
  if (picture.empty() || (picture.depth() != CV_8U && picture.depth() != CV_16U)) return std::nullopt;
  StoredPicture stored{picture.cols, picture.rows, picture.depth() == CV_16U ? white_of(picture) : 255, {}};
  const std::size_t row_bytes = picture.elemSize() * static_cast<std::size_t>(picture.cols);
  stored.pixels.resize(row_bytes * static_cast<std::size_t>(picture.rows));
  for (int v = 0; v < picture.rows; ++v)
    std::memcpy(stored.pixels.data() + row_bytes * static_cast<std::size_t>(v), picture.ptr(v), row_bytes);
  return stored;
}

std::vector<std::uint8_t> encode_png(const Frame& frame) {
  const cv::Mat picture(frame.height_px, frame.width_px, frame.white > 255 ? CV_16UC1 : CV_8UC1,
                        const_cast<std::uint8_t*>(frame.pixels.get()),
                        static_cast<std::size_t>(frame.stride_bytes));
  std::vector<std::uint8_t> png;
  cv::imencode(".png", picture, png);
  return png;
}

}  // namespace zeropose
