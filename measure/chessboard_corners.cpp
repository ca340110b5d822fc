#include "measure/chessboard_corners.h"

#include <opencv2/calib3d.hpp>

namespace zeropose {

std::vector<Eigen::Vector2d> chessboard_corners(const ImageView& image, int rows, int cols) {
  // OpenCV has no read-only view; the pixels are only read.
  const cv::Mat grey(image.height_px, image.width_px, CV_8UC1, const_cast<std::uint8_t*>(image.data),
                     static_cast<std::size_t>(image.stride_bytes));
  std::vector<cv::Point2f> found;
  try {
    constexpr int flags = cv::CALIB_CB_NORMALIZE_IMAGE | cv::CALIB_CB_EXHAUSTIVE;
    if (!cv::findChessboardCornersSB(grey, {cols, rows}, found, flags)) return {};
  } catch (const cv::Exception&) {  // what it cannot work with has no chessboard for us
    return {};
  }
  std::vector<Eigen::Vector2d> corners;
  for (const cv::Point2f& p : found) corners.emplace_back(double{p.x}, double{p.y});
  if (corners.size() != std::size_t(rows) * std::size_t(cols)) return {};
  return corners;
}

}  // namespace zeropose
