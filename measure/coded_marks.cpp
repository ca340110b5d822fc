#include "measure/coded_marks.h"

#include <algorithm>
#include <cmath>
#include <opencv2/aruco.hpp>
#include <optional>
#include <tuple>
#include <utility>

namespace zeropose {
namespace {

constexpr double least_rise = 10;  // grey levels over an edge

constexpr std::pair<std::string_view, int> dictionaries[] = {
    {"4x4_50", cv::aruco::DICT_4X4_50},           {"4x4_100", cv::aruco::DICT_4X4_100},
    {"4x4_250", cv::aruco::DICT_4X4_250},         {"4x4_1000", cv::aruco::DICT_4X4_1000},
    {"5x5_50", cv::aruco::DICT_5X5_50},           {"5x5_100", cv::aruco::DICT_5X5_100},
    {"5x5_250", cv::aruco::DICT_5X5_250},         {"5x5_1000", cv::aruco::DICT_5X5_1000},
    {"6x6_50", cv::aruco::DICT_6X6_50},           {"6x6_100", cv::aruco::DICT_6X6_100},
    {"6x6_250", cv::aruco::DICT_6X6_250},         {"6x6_1000", cv::aruco::DICT_6X6_1000},
    {"7x7_50", cv::aruco::DICT_7X7_50},           {"7x7_100", cv::aruco::DICT_7X7_100},
    {"7x7_250", cv::aruco::DICT_7X7_250},         {"7x7_1000", cv::aruco::DICT_7X7_1000},
    {"original", cv::aruco::DICT_ARUCO_ORIGINAL}, {"tag16h5", cv::aruco::DICT_APRILTAG_16h5},
    {"tag25h9", cv::aruco::DICT_APRILTAG_25h9},   {"tag36h10", cv::aruco::DICT_APRILTAG_36h10},
    {"tag36h11", cv::aruco::DICT_APRILTAG_36h11},
};

std::optional<int> dictionary_of(std::string_view name) {
  for (const auto& [known, number] : dictionaries) {
    if (known == name) return number;
  }
  return std::nullopt;
}

// One byte per pixel, which is all that OpenCV's search takes.
cv::Mat bytes_of(const ImageView& image) {
  cv::Mat grey(image.height_px, image.width_px, CV_8UC1);
  for (int v = 0; v < image.height_px; ++v) {
    for (int u = 0; u < image.width_px; ++u) {
      grey.at<std::uint8_t>(v, u) =
          static_cast<std::uint8_t>(std::min(255L, std::lround(image.grey_at(u, v))));
    }
  }
  return grey;
}

double cross(const Eigen::Vector2d& a, const Eigen::Vector2d& b) { return a.x() * b.y() - a.y() * b.x(); }

double grey_between(const ImageView& image, const Eigen::Vector2d& at) {
  const int u = std::clamp(static_cast<int>(at.x()), 0, image.width_px - 2);
  const int v = std::clamp(static_cast<int>(at.y()), 0, image.height_px - 2);
  const double x = at.x() - u, y = at.y() - v;
  return (1 - y) * ((1 - x) * image.grey_at(u, v) + x * image.grey_at(u + 1, v)) +
         y * ((1 - x) * image.grey_at(u, v + 1) + x * image.grey_at(u + 1, v + 1));
}

// How far outside of a place the black ends: the mean of the rises of grey along the normal, within reach.
// Nothing where there is no clear edge.
std::optional<double> edge_offset(const ImageView& image, const Eigen::Vector2d& at,
                                  const Eigen::Vector2d& outwards, double reach) {
  constexpr int steps = 16;
  double weights = 0, sum = 0, before = grey_between(image, at - reach * outwards);
  for (int k = 1; k <= steps; ++k) {
    const double here = grey_between(image, at + reach * (2.0 * k / steps - 1) * outwards);
    const double rise = here - before;
    weights += rise;
    sum += rise * reach * (2 * (k - 0.5) / steps - 1);
    before = here;
  }
  if (!(weights > least_rise)) return std::nullopt;
  return std::clamp(sum / weights, -reach, reach);
}

// A side of the square by the places where the black ends: a point of it and its direction.
struct CodedMarkSide {
  Eigen::Vector2d at, along;
};

CodedMarkSide side_of(const ImageView& image, const Eigen::Vector2d& from, const Eigen::Vector2d& to) {
  const Eigen::Vector2d along = (to - from).normalized(), outwards(along.y(), -along.x());
  const double length = (to - from).norm(), reach = std::min(3.0, 0.06 * length);
  double all = 0, n = 0, x1 = 0, y1 = 0, xx = 0, xy = 0;
  for (double share = 0.12; share < 0.885; share += 1 / std::max(16.0, length)) {
    const double x = (share - 0.5) * length;
    all += 1;
    const auto y = edge_offset(image, from + share * (to - from), outwards, reach);
    if (y) n += 1, x1 += x, y1 += *y, xx += x * x, xy += x * *y;
  }
  if (n < 0.5 * all) return {0.5 * (from + to), along};  // as OpenCV saw it
  const double slope = (xy - x1 * y1 / n) / (xx - x1 * x1 / n);
  const Eigen::Vector2d middle = 0.5 * (from + to) + (y1 - slope * x1) / n * outwards;
  return {middle, along + slope * outwards};
}

// Corners where the sides meet; those that would move by more than a pixel and a half stay.
void refine(const ImageView& image, std::array<Eigen::Vector2d, 4>& corners) {
  for (int round = 0; round < 2; ++round) {
    std::array<CodedMarkSide, 4> sides;
    for (std::size_t k = 0; k < 4; ++k) sides[k] = side_of(image, corners[k], corners[(k + 1) % 4]);
    for (std::size_t k = 0; k < 4; ++k) {
      const CodedMarkSide &one = sides[k], &other = sides[(k + 3) % 4];
      const double t = cross(other.at - one.at, other.along) / cross(one.along, other.along);
      const Eigen::Vector2d corner = one.at + t * one.along;
      if ((corner - corners[k]).norm() < 1.5) corners[k] = corner;
    }
  }
}

CodedMark mark_of(const ImageView& image, int id, const std::vector<cv::Point2f>& corners) {
  CodedMark mark;
  mark.id = id;
  for (std::size_t k = 0; k < 4; ++k) mark.corners_px[k] = {double{corners[k].x}, double{corners[k].y}};
  refine(image, mark.corners_px);
  const auto& c = mark.corners_px;
  const Eigen::Vector2d one = c[2] - c[0], other = c[3] - c[1];
  const double t = cross(c[1] - c[0], other) / cross(one, other);
  mark.centre_px = c[0] + t * one;
  return mark;
}

}  // namespace

bool is_code_dictionary(std::string_view name) { return dictionary_of(name).has_value(); }

std::vector<CodedMark> coded_marks(const ImageView& image, std::string_view dictionary) {
  std::vector<CodedMark> marks;
  const std::optional<int> number = dictionary_of(dictionary);
  if (!number || image.data == nullptr || image.width_px < 16 || image.height_px < 16) return marks;
  std::vector<std::vector<cv::Point2f>> corners;
  std::vector<int> ids;
  const auto parameters = cv::aruco::DetectorParameters::create();
  parameters->cornerRefinementMethod = cv::aruco::CORNER_REFINE_SUBPIX;
  parameters->cornerRefinementWinSize = 3;  // larger ones reach the code inside small marks
  parameters->cornerRefinementMaxIterations = 60;
  parameters->cornerRefinementMinAccuracy = 0.002;
  try {
    cv::aruco::detectMarkers(bytes_of(image), cv::aruco::getPredefinedDictionary(*number), corners, ids,
                             parameters);
  } catch (const cv::Exception&) {  // what it cannot work with has no marks for us
    return {};
  }
  for (std::size_t k = 0; k < ids.size(); ++k) marks.push_back(mark_of(image, ids[k], corners[k]));
  std::sort(marks.begin(), marks.end(), [](const CodedMark& a, const CodedMark& b) {
    return std::make_tuple(a.id, a.centre_px.y(), a.centre_px.x()) <
           std::make_tuple(b.id, b.centre_px.y(), b.centre_px.x());
  });
  return marks;
}

}  // namespace zeropose
