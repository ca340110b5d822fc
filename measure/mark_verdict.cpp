#include "measure/mark_verdict.h"

#include <algorithm>
#include <cmath>

namespace zeropose {
namespace {

constexpr double noise_sigmas = 4;        // how far two variances of the same noise may differ
constexpr double most_noise_share = 0.3;  // of the contrast

}  // namespace

bool place_makes_sense(const MarkSearch& s) {
  return s.expected_px.allFinite() && s.half_window_px.allFinite() && (s.half_window_px.array() >= 0).all() &&
         std::isfinite(s.min_contrast) && s.min_contrast > 0 && std::isfinite(s.max_blur_px) &&
         s.max_blur_px > 0;
}

bool sizes_make_sense(const MarkSearch& s) {
  return std::isfinite(s.max_diameter_px) && s.min_diameter_px > 0 &&
         s.min_diameter_px <= s.max_diameter_px && s.min_axis_ratio > 0 && s.min_axis_ratio <= 1;
}

bool directions_make_sense(const MarkSearch& s) {
  return std::isfinite(s.direction_rad) && s.direction_tolerance_rad >= 0 && std::isfinite(s.opening_rad) &&
         s.opening_tolerance_rad >= 0;
}

bool pixels_agree(const FitEvidence& e, double model_share, double most_noise_grey) {
  const double noise = std::min({e.flat_rms, most_noise_share * e.contrast, most_noise_grey});
  const double model = model_share * e.contrast;
  const double allowed2 = noise * noise * (1 + noise_sigmas * e.spread) + model * model;
  const double outline2 = 2.5 * e.outline_noise_px * e.outline_noise_px + rough_px * rough_px;
  return e.edge_rms * e.edge_rms < allowed2 && e.outline_px * e.outline_px < outline2;
}

double quality_of(const FitEvidence& e) {
  const double noise = e.flat_rms > 0 ? e.flat_rms : 0.02 * e.contrast,
               model = plain_model_share * e.contrast;
  return 1 / (1 + std::max(0.0, e.edge_rms * e.edge_rms - noise * noise) / (model * model));
}

}  // namespace zeropose
