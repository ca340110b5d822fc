#include "measure/marks.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "measure/mark_candidates.h"
#include "measure/mark_fit.h"

namespace zeropose {
namespace {

constexpr std::size_t most_candidates = 8;  // fits per window
constexpr double rival_contrast = 0.4;      // of the best one's: then it is a rival

bool makes_sense(const ImageView& image, const MarkSearch& s) {
  return image.data != nullptr && s.expected_px.allFinite() && s.half_window_px.allFinite() &&
         (s.half_window_px.array() >= 0).all() && std::isfinite(s.max_diameter_px) && s.min_diameter_px > 0 &&
         s.min_diameter_px <= s.max_diameter_px && s.min_axis_ratio > 0 && s.min_axis_ratio <= 1 &&
         s.min_contrast > 0;
}

int pixel_of(double place, int size) { return static_cast<int>(std::clamp(place, -1.0, double(size))); }

// How near to a found mark a failed one came.
int telling(MarkStatus status) {
  switch (status) {
    case MarkStatus::too_small:
      return 1;
    case MarkStatus::not_converged:
      return 2;
    case MarkStatus::low_contrast:
      return 3;
    case MarkStatus::cut_off:
      return 4;
    case MarkStatus::saturated:
      return 5;
    default:
      return 0;
  }
}

// One that fits its ellipse, or would if it were not saturated.
bool stands(const MarkFinding& finding) {
  return finding.status == MarkStatus::found || finding.status == MarkStatus::saturated;
}

MarkFinding with_status(MarkStatus status) {
  MarkFinding finding;
  finding.status = status;
  return finding;
}

// The same thing, taken up twice from different grey levels.
bool same_place(const MarkFinding& a, const MarkFinding& b) {
  return (a.u_px - b.u_px).norm() < 0.5 && std::abs(a.diameter_px - b.diameter_px) < 1;
}

struct Workspace {
  CandidateFinder candidates;
  EllipseWorkspace ellipse;
};

// The best of the candidates, ambiguous if another one stands beside it, or the most telling reason.
MarkFinding best_of(const ImageView& image, const MarkSearch& search, const CandidateSearch& seen,
                    EllipseWorkspace& workspace) {
  MarkFinding best = with_status(seen.reason);
  for (std::size_t k = 0; k < std::min(most_candidates, seen.candidates.size()); ++k) {
    const MarkFinding finding = fit_mark(image, search, seen.candidates[k].start, workspace);
    if (!stands(best)) {
      if (stands(finding) || telling(finding.status) >= telling(best.status)) best = finding;
    } else if (stands(finding) && !same_place(finding, best) &&
               std::min(finding.contrast, best.contrast) >
                   rival_contrast * std::max(finding.contrast, best.contrast)) {
      return with_status(MarkStatus::ambiguous);
    }
  }
  return best;
}

// Levels so far apart that a rival could slip through call for a closer look.
bool decided(const MarkFinding& finding, const CandidateSearch& seen) {
  return finding.status == MarkStatus::ambiguous ||
         (stands(finding) && seen.step_grey < 0.75 * rival_contrast * finding.contrast);
}

MarkFinding find_mark(const ImageView& image, const MarkSearch& search, Workspace& workspace) {
  if (image.data == nullptr || image.width_px < 2 || image.height_px < 2) {
    return with_status(MarkStatus::outside_image);
  }
  if (!makes_sense(image, search)) return {};
  const PixelWindow window = window_of(image, search);
  if (window.empty()) return with_status(MarkStatus::outside_image);
  std::optional<CandidateSearch> seen = workspace.candidates.first(image, window, search);
  MarkFinding best;
  while (seen) {
    best = best_of(image, search, *seen, workspace.ellipse);
    if (decided(best, *seen)) break;
    seen = workspace.candidates.finer(image, window, search);
  }
  return best.status == MarkStatus::found ? best : with_status(best.status);
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
  Workspace workspace;
  for (const MarkSearch& search : searches) findings.push_back(find_mark(image, search, workspace));
  return findings;
}

}  // namespace zeropose
