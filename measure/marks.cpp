#include "measure/marks.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "measure/ellipse_fit.h"
#include "measure/mark_candidates.h"

namespace zeropose {
namespace {

constexpr std::size_t most_candidates = 8;  // fits per window
constexpr double rival_contrast = 0.4;      // of the best one's: then it is a rival
constexpr double model_share = 0.04;        // of the contrast: how far real edges are from the model, rms
constexpr double noise_sigmas = 4;          // how far two variances of the same noise may differ
constexpr double rough_px = 0.15;         // what the outline of a real mark may deviate from an ellipse, rms
constexpr double most_noise_share = 0.3;  // of the contrast
constexpr double saturated_share = 0.02;  // of the pixels across the outline

bool makes_sense(const ImageView& image, const MarkSearch& s) {
  return image.data != nullptr && s.expected_px.allFinite() && s.half_window_px.allFinite() &&
         (s.half_window_px.array() >= 0).all() && std::isfinite(s.max_diameter_px) && s.min_diameter_px > 0 &&
         s.min_diameter_px <= s.max_diameter_px && s.min_axis_ratio > 0 && s.min_axis_ratio <= 1 &&
         s.min_contrast > 0;
}

int pixel_of(double place, int size) { return static_cast<int>(std::clamp(place, -1.0, double(size))); }

PixelWindow window_of(const ImageView& image, const MarkSearch& s) {
  const Eigen::Vector2d low = s.expected_px - s.half_window_px, high = s.expected_px + s.half_window_px;
  return {std::max(0, pixel_of(std::ceil(low.x()), image.width_px)),
          std::max(0, pixel_of(std::ceil(low.y()), image.height_px)),
          std::min(image.width_px - 1, pixel_of(std::floor(high.x()), image.width_px)),
          std::min(image.height_px - 1, pixel_of(std::floor(high.y()), image.height_px))};
}

bool band_in_image(const ImageView& image, const EllipseStart& start) {
  const double u = std::sqrt(start.shape_px2(0, 0)) + ellipse_band_px + 0.5;
  const double v = std::sqrt(start.shape_px2(1, 1)) + ellipse_band_px + 0.5;
  return start.centre_px.x() - u >= 0 && start.centre_px.x() + u <= image.width_px - 1 &&
         start.centre_px.y() - v >= 0 && start.centre_px.y() + v <= image.height_px - 1;
}

MarkFinding finding_of(const EllipseFit& fit) {
  const HalfAxes axes = half_axes(fit.shape_px2);
  MarkFinding finding;
  finding.u_px = fit.centre_px;
  finding.covariance_px2 = fit.covariance_px2;
  finding.diameter_px = 2 * axes.major_px;
  finding.axis_ratio = axes.minor_px / axes.major_px;
  finding.contrast = std::abs(fit.background_grey - fit.mark_grey);
  const double noise = fit.flat_rms > 0 ? fit.flat_rms : 0.02 * finding.contrast;
  const double excess = std::max(0.0, fit.edge_rms * fit.edge_rms - noise * noise);
  const double allowed = model_share * finding.contrast;
  finding.quality = 1 / (1 + excess / (allowed * allowed));
  return finding;
}

// Residuals across the outline: noise as in the flat rings, and a small share of the contrast. And the
// outline is where the region was.
bool explains(const EllipseFit& fit, const MarkFinding& finding, const EllipseStart& start) {
  const double noise = std::min(fit.flat_rms, most_noise_share * finding.contrast);
  const double spread = std::sqrt(2 / fit.edge_count + 2 / std::max(1.0, fit.flat_count));
  const double model = model_share * finding.contrast;
  const double allowed2 = noise * noise * (1 + noise_sigmas * spread) + model * model;
  const double outline2 = 2.5 * fit.outline_noise_px * fit.outline_noise_px + rough_px * rough_px;
  const HalfAxes before = half_axes(start.shape_px2);
  const double room = 1 + 0.05 * before.major_px;
  return fit.edge_rms * fit.edge_rms < allowed2 && fit.outline_px * fit.outline_px < outline2 &&
         (fit.centre_px - start.centre_px).norm() < room &&
         std::abs(0.5 * finding.diameter_px - before.major_px) < room;
}

MarkFinding judged(const ImageView& image, const MarkSearch& search, const EllipseStart& start,
                   EllipseWorkspace& workspace) {
  MarkFinding finding;
  finding.status = MarkStatus::cut_off;
  if (!band_in_image(image, start)) return finding;
  const EllipseFit fit = fit_ellipse(image, start, workspace);
  finding.status = MarkStatus::not_converged;
  if (!fit.converged) return finding;
  finding = finding_of(fit);
  const bool bright = fit.mark_grey > fit.background_grey;
  if (fit.saturated_share > saturated_share) {
    finding.status = MarkStatus::saturated;
  } else if (!explains(fit, finding, start) || bright != (search.kind == MarkKind::bright_disc)) {
    finding.status = MarkStatus::not_converged;
  } else if (finding.contrast < search.min_contrast) {
    finding.status = MarkStatus::low_contrast;
  } else if (finding.diameter_px < search.min_diameter_px) {
    finding.status = MarkStatus::too_small;
  } else if (finding.diameter_px > search.max_diameter_px || finding.axis_ratio < search.min_axis_ratio) {
    finding.status = MarkStatus::no_candidate;
  } else {
    finding.status = MarkStatus::found;
  }
  return finding;
}

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
    const MarkFinding finding = judged(image, search, seen.candidates[k].start, workspace);
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
