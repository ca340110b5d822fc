#include "measure/chessboard_corners.h"

#include <opencv2/calib3d.hpp>

namespace zeropose {
namespace {

constexpr int careful = cv::CALIB_CB_NORMALIZE_IMAGE | cv::CALIB_CB_EXHAUSTIVE;
constexpr int smallest_part = 3;

ChessboardCorners search(const ImageView& image, cv::Size size, int flags) {
  // OpenCV has no read-only view; the pixels are only read.
  const cv::Mat grey(image.height_px, image.width_px, CV_8UC1, const_cast<std::uint8_t*>(image.data),
                     static_cast<std::size_t>(image.stride_bytes));
  std::vector<cv::Point2f> found;
  cv::Mat layout;  // one entry per corner
  try {
    if (!cv::findChessboardCornersSB(grey, size, found, flags, layout)) return {};
  } catch (const cv::Exception&) {  // what it cannot work with has no chessboard for us
    return {};
  }
  ChessboardCorners corners{layout.rows, layout.cols, {}};
  for (const cv::Point2f& p : found) corners.at_px.emplace_back(double{p.x}, double{p.y});
  if (corners.at_px.size() != std::size_t(corners.rows) * std::size_t(corners.cols)) return {};
  return corners;
}

}  // namespace

ChessboardCorners chessboard_corners(const ImageView& image, int rows, int cols) {
  const ChessboardCorners corners = search(image, {cols, rows}, careful);
  return corners.rows == rows && corners.cols == cols ? corners : ChessboardCorners{};
}

ChessboardCorners part_of_chessboard(const ImageView& image) {
  return search(image, {smallest_part, smallest_part}, careful | cv::CALIB_CB_LARGER);
}

}  // namespace zeropose
