#include "measure/edge_mark_judge.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace zeropose {
namespace {

constexpr int least_side_px = 8;  // of a window
constexpr double model_share = 0.04, most_noise_share = 0.3, saturated_share = 0.02;
constexpr double rough_px = 0.15;       // what a real outline may deviate, rms
constexpr double noise_sigmas = 4;      // how far two variances of the same noise may differ
constexpr double rival_strength = 0.5;  // of the best one's: then it is a rival
constexpr double same_px = 1, same_rad = 0.1;
constexpr double most_sigma_px = 0.3;  // of a place that counts

bool makes_sense(const ImageView& image, const MarkSearch& s, bool limits_sizes) {
  const bool sizes = !limits_sizes || (s.min_diameter_px > 0 && s.min_diameter_px <= s.max_diameter_px &&
                                       s.min_axis_ratio > 0 && s.min_axis_ratio <= 1);
  return image.data != nullptr && s.expected_px.allFinite() && s.half_window_px.allFinite() &&
         (s.half_window_px.array() >= 0).all() && std::isfinite(s.min_diameter_px) &&
         std::isfinite(s.max_diameter_px) && sizes && std::isfinite(s.min_contrast) && s.min_contrast > 0 &&
         std::isfinite(s.max_blur_px) && s.max_blur_px > 0 && std::isfinite(s.direction_rad) &&
         s.direction_tolerance_rad >= 0 && std::isfinite(s.opening_rad) && s.opening_tolerance_rad >= 0;
}

// Residuals across the outline: noise as beside it, and a small share of the contrast.
bool explains(const ContourFit& fit, double contrast) {
  const double noise = std::min(fit.flat_rms, most_noise_share * contrast), model = model_share * contrast;
  const double spread = std::sqrt(4 / std::max(1.0, fit.pixels));
  const double outline2 = 2.5 * fit.outline_noise_px * fit.outline_noise_px + rough_px * rough_px;
  return fit.edge_rms * fit.edge_rms < noise * noise * (1 + noise_sigmas * spread) + model * model &&
         fit.outline_px * fit.outline_px < outline2;
}

// How near to a found mark a failed one came.
int telling(MarkStatus status) {
  switch (status) {
    case MarkStatus::no_candidate:
      return 1;
    case MarkStatus::too_small:
      return 2;
    case MarkStatus::not_converged:
      return 3;
    case MarkStatus::low_contrast:
      return 4;
    case MarkStatus::blurred:
      return 5;
    case MarkStatus::cut_off:
      return 6;
    case MarkStatus::saturated:
      return 7;
    default:
      return 0;
  }
}

bool passed(const JudgedMark& mark) {
  return mark.finding.status == MarkStatus::found || mark.finding.status == MarkStatus::saturated;
}

// What holds a mark in some direction by its last pixels only is not held.
bool sure_place(const MarkFinding& finding, MarkKind kind) {
  const Eigen::Matrix2d& S = finding.covariance_px2;
  const double mean = S.trace() / 2, spread = std::hypot((S(0, 0) - S(1, 1)) / 2, S(0, 1));
  const double variance = kind == MarkKind::edge ? mean - spread : mean + spread;
  return variance < most_sigma_px * most_sigma_px;
}

bool same_mark(const MarkFinding& a, const MarkFinding& b) {
  return (a.u_px - b.u_px).norm() < same_px &&
         std::abs(wrapped_rad(a.direction_rad - b.direction_rad)) < same_rad;
}

}  // namespace

OpenedWindow open_window(const ImageView& image, const MarkSearch& search, bool limits_sizes) {
  OpenedWindow opened;
  opened.status = MarkStatus::outside_image;
  if (image.data == nullptr || image.width_px < 2 || image.height_px < 2) return opened;
  opened.status = MarkStatus::not_searched;
  if (!makes_sense(image, search, limits_sizes)) return opened;
  opened.status = MarkStatus::outside_image;
  opened.greys.pixels = window_of(image, search);
  if (opened.greys.pixels.empty()) return opened;
  opened.status = MarkStatus::no_candidate;
  if (std::min(opened.greys.width(), opened.greys.height()) < least_side_px) return opened;
  copy_greys(image, opened.greys.pixels, opened.greys.grey);
  const double count = image.grey_per_count();
  opened.greys.rounding_variance = count * count / 12;
  opened.status = MarkStatus::found;
  return opened;
}

MarkFinding judged_fit(const ContourFit& fit, const MarkSearch& search) {
  MarkFinding finding;
  finding.contrast = std::abs(fit.background_grey - fit.mark_grey);
  finding.blur_px = fit.blur_px;
  finding.outline_share = fit.outline_share;
  const double noise = fit.flat_rms > 0 ? fit.flat_rms : 0.02 * finding.contrast;
  const double excess = std::max(0.0, fit.edge_rms * fit.edge_rms - noise * noise);
  finding.quality = fit.converged ? 1 / (1 + excess / std::pow(model_share * finding.contrast, 2)) : 0;
  if (!fit.converged) {
    finding.status = MarkStatus::not_converged;
  } else if (fit.saturated_share > saturated_share) {
    finding.status = MarkStatus::saturated;
  } else if (!explains(fit, finding.contrast)) {
    finding.status = MarkStatus::not_converged;
  } else if (finding.contrast < search.min_contrast) {
    finding.status = MarkStatus::low_contrast;
  } else if (fit.blur_px > search.max_blur_px) {
    finding.status = MarkStatus::blurred;
  } else {
    finding.status = MarkStatus::found;
  }
  return finding;
}

MarkFinding chosen_mark(std::vector<JudgedMark> marks, const GreyWindow& window, const MarkSearch& search) {
  for (JudgedMark& mark : marks)
    if (mark.finding.status == MarkStatus::found && !sure_place(mark.finding, search.kind))
      mark.finding.status = MarkStatus::not_converged;
  JudgedMark best;
  best.finding.status = MarkStatus::no_candidate;
  if (marks.empty()) {
    const auto [low, high] = std::minmax_element(window.grey.begin(), window.grey.end());
    if (*high - *low < search.min_contrast) best.finding.status = MarkStatus::low_contrast;
  }
  for (const JudgedMark& mark : marks) {
    const bool better = passed(mark) == passed(best)
                            ? (passed(mark) ? mark.strength > best.strength
                                            : telling(mark.finding.status) > telling(best.finding.status))
                            : passed(mark);
    if (better) best = mark;
  }
  if (!passed(best)) return best.finding;
  for (const JudgedMark& mark : marks) {
    if (passed(mark) && !same_mark(mark.finding, best.finding) &&
        mark.strength > rival_strength * best.strength) {
      best.finding.status = MarkStatus::ambiguous;
    }
  }
  return best.finding;
}

double wrapped_line_rad(double angle_rad) { return std::remainder(angle_rad, std::numbers::pi); }

Eigen::Vector2d to_image(const GreyWindow& window, const Eigen::Vector2d& at) {
  return at + Eigen::Vector2d(window.pixels.u0, window.pixels.v0);
}

Eigen::Vector2d to_window(const GreyWindow& window, const Eigen::Vector2d& u_px) {
  return u_px - Eigen::Vector2d(window.pixels.u0, window.pixels.v0);
}

LineLimits line_limits_of(const MarkSearch& search) {
  LineLimits limits;
  limits.min_contrast = search.min_contrast;
  limits.max_blur_px = search.max_blur_px;
  return limits;
}

}  // namespace zeropose
