#include "daemon/overlay.h"

#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include <cmath>

namespace zeropose {
namespace {

const cv::Scalar blue(235, 160, 60), green(60, 220, 60), red(60, 60, 240);

// Drawing coordinates are fixed point: 1/16 px.
constexpr int sub_bits = 4;
cv::Point fixed(const Eigen::Vector2d& u_px) {
  return {static_cast<int>(std::lround(u_px.x() * (1 << sub_bits))),
          static_cast<int>(std::lround(u_px.y() * (1 << sub_bits)))};
}

void write_text(cv::Mat& picture, const std::string& text, const Eigen::Vector2d& at_px,
                const cv::Scalar& colour) {
  const cv::Point corner(static_cast<int>(at_px.x()), static_cast<int>(at_px.y()));
  cv::putText(picture, text, corner, cv::FONT_HERSHEY_SIMPLEX, 0.45, cv::Scalar(0, 0, 0), 3, cv::LINE_AA);
  cv::putText(picture, text, corner, cv::FONT_HERSHEY_SIMPLEX, 0.45, colour, 1, cv::LINE_AA);
}

void draw_found(cv::Mat& picture, const MarkFinding& finding) {
  const Eigen::Vector2d across(5, 0), along(0, 5);
  cv::line(picture, fixed(finding.u_px - across), fixed(finding.u_px + across), green, 1, cv::LINE_AA,
           sub_bits);
  cv::line(picture, fixed(finding.u_px - along), fixed(finding.u_px + along), green, 1, cv::LINE_AA,
           sub_bits);
  cv::circle(picture, fixed(finding.u_px), static_cast<int>(finding.diameter_px / 2 + 6) << sub_bits, green,
             1, cv::LINE_AA, sub_bits);
}

void draw(cv::Mat& picture, const MarkOverlay& mark) {
  const Eigen::Vector2d corner = mark.search.expected_px - mark.search.half_window_px;
  const bool found = mark.finding.status == MarkStatus::found;
  cv::rectangle(picture, fixed(corner), fixed(mark.search.expected_px + mark.search.half_window_px),
                found ? blue : red, 1, cv::LINE_AA, sub_bits);
  if (found) draw_found(picture, mark.finding);
  const std::string text = found ? mark.name : mark.name + ": " + std::string(name_of(mark.finding.status));
  write_text(picture, text, corner + Eigen::Vector2d(4, 14), found ? green : red);
}

}  // namespace

std::vector<std::uint8_t> overlay_png(const ImageView& image, std::span<const MarkOverlay> marks) {
  // OpenCV has no read-only view; the pixels are only read.
  const cv::Mat grey(image.height_px, image.width_px, CV_8UC1, const_cast<std::uint8_t*>(image.data),
                     static_cast<std::size_t>(image.stride_bytes));
  cv::Mat picture;
  cv::cvtColor(grey, picture, cv::COLOR_GRAY2BGR);
  for (const auto& mark : marks) draw(picture, mark);
  std::vector<std::uint8_t> png;
  cv::imencode(".png", picture, png);
  return png;
}

}  // namespace zeropose
