#include "measure/marks.h"

#include <algorithm>
#include <cmath>

#include "measure/disc_search.h"

namespace zeropose {
namespace {

bool makes_sense(const ImageView& image, const MarkSearch& s) {
  return image.data != nullptr && s.expected_px.allFinite() && s.half_window_px.allFinite() &&
         (s.half_window_px.array() >= 0).all() && std::isfinite(s.max_diameter_px) && s.min_diameter_px > 0 &&
         s.min_diameter_px <= s.max_diameter_px && s.min_axis_ratio > 0 && s.min_axis_ratio <= 1 &&
         s.min_contrast > 0;
}

int pixel_of(double place, int size) { return static_cast<int>(std::clamp(place, -1.0, double(size))); }

MarkFinding with_status(MarkStatus status) {
  MarkFinding finding;
  finding.status = status;
  return finding;
}

MarkFinding find_mark(const ImageView& image, const MarkSearch& search, MarkWorkspace& workspace) {
  if (image.data == nullptr || image.width_px < 2 || image.height_px < 2)
    return with_status(MarkStatus::outside_image);
  if (!makes_sense(image, search)) return {};
  const PixelWindow window = window_of(image, search);
  if (window.empty()) return with_status(MarkStatus::outside_image);
  return look_for_discs(image, window, search, workspace).only();
}

}  // namespace

PixelWindow window_of(const ImageView& image, const MarkSearch& s) {
  const Eigen::Vector2d low = s.expected_px - s.half_window_px, high = s.expected_px + s.half_window_px;
  return {std::max(0, pixel_of(std::ceil(low.x()), image.width_px)),
          std::max(0, pixel_of(std::ceil(low.y()), image.height_px)),
          std::min(image.width_px - 1, pixel_of(std::floor(high.x()), image.width_px)),
          std::min(image.height_px - 1, pixel_of(std::floor(high.y()), image.height_px))};
}

std::string_view name_of(MarkStatus status) {
  switch (status) {
    case MarkStatus::not_searched:
      return "not_searched";
    case MarkStatus::found:
      return "found";
    case MarkStatus::outside_image:
      return "outside_image";
    case MarkStatus::no_candidate:
      return "no_candidate";
    case MarkStatus::too_small:
      return "too_small";
    case MarkStatus::low_contrast:
      return "low_contrast";
    case MarkStatus::blurred:
      return "blurred";
    case MarkStatus::saturated:
      return "saturated";
    case MarkStatus::cut_off:
      return "cut_off";
    case MarkStatus::ambiguous:
      return "ambiguous";
    case MarkStatus::not_converged:
      return "not_converged";
  }
  return "unknown";
}

std::vector<MarkFinding> find_marks(const ImageView& image, std::span<const MarkSearch> searches) {
  std::vector<MarkFinding> findings;
  findings.reserve(searches.size());
  MarkWorkspace workspace;
  for (const MarkSearch& search : searches) findings.push_back(find_mark(image, search, workspace));
  return findings;
}

}  // namespace zeropose
