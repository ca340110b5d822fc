#include "measure/coded_marks.h"

#include <algorithm>
#include <cmath>
#include <opencv2/aruco.hpp>
#include <optional>
#include <tuple>
#include <utility>

namespace zeropose {
namespace {

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
      grey.at<std::uint8_t>(v, u) = static_cast<std::uint8_t>(std::lround(image.grey_at(u, v)));
    }
  }
  return grey;
}

double cross(const Eigen::Vector2d& a, const Eigen::Vector2d& b) { return a.x() * b.y() - a.y() * b.x(); }

CodedMark mark_of(int id, const std::vector<cv::Point2f>& corners) {
  CodedMark mark;
  mark.id = id;
  for (std::size_t k = 0; k < 4; ++k) mark.corners_px[k] = {double{corners[k].x}, double{corners[k].y}};
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
  for (std::size_t k = 0; k < ids.size(); ++k) marks.push_back(mark_of(ids[k], corners[k]));
  std::sort(marks.begin(), marks.end(), [](const CodedMark& a, const CodedMark& b) {
    return std::make_tuple(a.id, a.centre_px.y(), a.centre_px.x()) <
           std::make_tuple(b.id, b.centre_px.y(), b.centre_px.x());
  });
  return marks;
}

}  // namespace zeropose
