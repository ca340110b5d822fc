#include "daemon/overlay.h"

#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <iomanip>
#include <sstream>

namespace zeropose {
namespace {

const cv::Scalar blue(235, 160, 60), green(60, 220, 60), red(60, 60, 240), orange(40, 140, 255);

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
  if (finding.shape_px2.isZero()) return;
  const double mean = finding.shape_px2.trace() / 2;
  const double spread =
      std::hypot((finding.shape_px2(0, 0) - finding.shape_px2(1, 1)) / 2, finding.shape_px2(0, 1));
  const double angle =
      0.5 * std::atan2(2 * finding.shape_px2(0, 1), finding.shape_px2(0, 0) - finding.shape_px2(1, 1));
  const cv::Point half = fixed({std::sqrt(mean + spread), std::sqrt(std::max(0.0, mean - spread))});
  cv::ellipse(picture, fixed(finding.u_px), {half.x, half.y}, angle * 180 / CV_PI, 0, 360, green, 1,
              cv::LINE_AA, sub_bits);
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

// The window as it is turned.
void draw_window(cv::Mat& picture, const GapSearch& search, const cv::Scalar& colour) {
  const Eigen::Vector2d across(std::cos(search.direction_rad), std::sin(search.direction_rad));
  const Eigen::Vector2d a = search.half_across_px * across;
  const Eigen::Vector2d l = search.half_along_px * Eigen::Vector2d(-across.y(), across.x());
  const Eigen::Vector2d& c = search.centre_px;
  const std::array<Eigen::Vector2d, 4> corners{c - a - l, c + a - l, c + a + l, c - a + l};
  for (std::size_t i = 0; i < corners.size(); ++i)
    cv::line(picture, fixed(corners[i]), fixed(corners[(i + 1) % corners.size()]), colour, 1, cv::LINE_AA,
             sub_bits);
}

void draw_edge(cv::Mat& picture, const MarkFinding& edge, const cv::Scalar& colour) {
  if (edge.diameter_px <= 0) return;
  const Eigen::Vector2d along(-std::sin(edge.direction_rad), std::cos(edge.direction_rad));
  cv::line(picture, fixed(edge.u_px - edge.diameter_px / 2 * along),
           fixed(edge.u_px + edge.diameter_px / 2 * along), colour, 1, cv::LINE_AA, sub_bits);
}

// A sentence in as many lines as the picture's width needs.
void write_lines(cv::Mat& picture, const std::string& text, Eigen::Vector2d at_px, const cv::Scalar& colour) {
  constexpr double line_px = 16, letter_px = 8.5;
  const auto most = static_cast<std::size_t>(std::max(10.0, (picture.cols - at_px.x()) / letter_px));
  for (std::size_t from = 0; from < text.size();) {
    std::size_t length = std::min(most, text.size() - from);
    const std::size_t space = text.rfind(' ', from + length);
    if (from + length < text.size() && space != std::string::npos && space > from) length = space - from;
    write_text(picture, text.substr(from, length), at_px, colour);
    from += length + 1;
    at_px.y() += line_px;
  }
}

void draw(cv::Mat& picture, const GapOverlay& gap) {
  const bool found = gap.found.status == GapStatus::ok;
  draw_window(picture, gap.search, found ? blue : red);
  for (const GapEdge* edge : {&gap.found.frame, &gap.found.pane})
    draw_edge(picture, edge->finding, edge->finding.status == MarkStatus::found ? green : red);
  if (found)
    cv::line(picture, fixed(gap.found.frame.finding.u_px), fixed(gap.found.pane.finding.u_px), green, 1,
             cv::LINE_AA, sub_bits);
  std::ostringstream text;
  text << gap.name << ": ";
  if (found)
    text << std::fixed << std::setprecision(3) << gap.found.gap_mm << " mm";
  else
    text << name_of(gap.found.status);
  write_text(picture, text.str(), {8, 20}, found ? green : red);
  if (!found) write_lines(picture, gap.found.reason, {8, 38}, red);
}

// Centre by centre: what lies between was not seen.
void draw(cv::Mat& picture, const LightLine& line, const cv::Scalar& colour) {
  for (const LineCentre& centre : line.centres) {
    const bool upright = line.course == LineCourse::upright;
    const Eigen::Vector2d at(upright ? centre.place : centre.at, upright ? centre.at : centre.place);
    cv::circle(picture, fixed(at), 6, colour, cv::FILLED, cv::LINE_AA, sub_bits);
  }
}

cv::Mat colour_copy(const ImageView& image) {
  // OpenCV has no read-only view; the pixels are only read.
  cv::Mat grey(image.height_px, image.width_px, image.two_bytes() ? CV_16UC1 : CV_8UC1,
               const_cast<std::uint8_t*>(image.data), static_cast<std::size_t>(image.stride_bytes));
  if (image.two_bytes()) {
    cv::Mat bytes;
    grey.convertTo(bytes, CV_8U, image.grey_per_count());
    grey = bytes;
  }
  cv::Mat picture;
  cv::cvtColor(grey, picture, cv::COLOR_GRAY2BGR);
  return picture;
}

std::vector<std::uint8_t> png_of(const cv::Mat& picture) {
  std::vector<std::uint8_t> png;
  cv::imencode(".png", picture, png);
  return png;
}

// A round point with its name.
void draw(cv::Mat& picture, const BoardPoint& point, const std::string& text) {
  const Eigen::Vector2d across(3, 0), along(0, 3);
  cv::line(picture, fixed(point.u_px - across), fixed(point.u_px + across), green, 1, cv::LINE_AA, sub_bits);
  cv::line(picture, fixed(point.u_px - along), fixed(point.u_px + along), green, 1, cv::LINE_AA, sub_bits);
  if (point.diameter_px > 0)
    cv::circle(picture, fixed(point.u_px), static_cast<int>(point.diameter_px / 2 + 1) << sub_bits, green, 1,
               cv::LINE_AA, sub_bits);
  const cv::Point corner(static_cast<int>(point.u_px.x()) + 4, static_cast<int>(point.u_px.y()) - 4);
  cv::putText(picture, text, corner, cv::FONT_HERSHEY_SIMPLEX, 0.3, cv::Scalar(0, 0, 0), 2, cv::LINE_AA);
  cv::putText(picture, text, corner, cv::FONT_HERSHEY_SIMPLEX, 0.3, green, 1, cv::LINE_AA);
}

}  // namespace

std::vector<std::uint8_t> overlay_png(const ImageView& image, std::span<const MarkOverlay> marks) {
  cv::Mat picture = colour_copy(image);
  for (const auto& mark : marks) draw(picture, mark);
  return png_of(picture);
}

std::vector<std::uint8_t> overlay_png(const ImageView& image, std::span<const GapOverlay> gaps) {
  cv::Mat picture = colour_copy(image);
  for (const auto& gap : gaps) draw(picture, gap);
  return png_of(picture);
}

std::vector<std::uint8_t> overlay_png(const ImageView& image, const LineArrayResult& lines) {
  cv::Mat picture = colour_copy(image);
  if (lines.status != LineArrayStatus::ok) {
    for (const LightLine& line : lines.found) draw(picture, line, red);
    write_lines(picture, lines.reason, {8, 20}, red);
    return png_of(picture);
  }
  for (const LightLine& line : lines.radial) draw(picture, line, green);
  for (const LightLine& line : lines.across) draw(picture, line, blue);
  for (const auto& row : lines.crossings)
    for (const auto& crossing : row)
      if (crossing) cv::circle(picture, fixed(*crossing), 4 << sub_bits, orange, 1, cv::LINE_AA, sub_bits);
  return png_of(picture);
}

std::vector<std::uint8_t> overlay_png(const ImageView& image, const BoardResult& board) {
  cv::Mat picture = colour_copy(image);
  for (std::size_t k = 1; k < board.points.size(); ++k) {
    const BoardPoint &last = board.points[k - 1], &next = board.points[k];
    const bool turn = last.at.row != next.at.row;
    cv::line(picture, fixed(last.u_px), fixed(next.u_px), turn ? red : blue, 1, cv::LINE_AA, sub_bits);
  }
  for (const BoardPoint& point : board.points)
    draw(picture, point, std::to_string(point.at.row) + "." + std::to_string(point.at.col));
  if (!board.reason.empty())
    write_text(picture, board.reason, {4, 14}, board.status == BoardStatus::found ? blue : red);
  return png_of(picture);
}

std::vector<std::uint8_t> overlay_png(const ImageView& image, const BodyResult& body,
                                      std::span<const BodyMark> marks) {
  cv::Mat picture = colour_copy(image);
  for (const BodyPoint& point : body.points)
    draw(picture, {{}, Eigen::Vector3d::Zero(), point.u_px, point.covariance_px2, point.diameter_px},
         marks[point.mark].name);
  if (!body.reason.empty())
    write_text(picture, body.reason, {4, 14}, body.status == BodyStatus::found ? blue : red);
  return png_of(picture);
}

}  // namespace zeropose
