#include "measure/mark_fit.h"

#include <algorithm>
#include <cmath>

namespace zeropose {
namespace {

constexpr double noise_sigmas = 4;        // how far two variances of the same noise may differ
constexpr double rough_px = 0.15;         // what the outline of a real mark may deviate from an ellipse, rms
constexpr double most_noise_share = 0.3;  // of the contrast
constexpr double saturated_share = 0.02;  // of the pixels across the outline

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
  finding.shape_px2 = fit.shape_px2;
  finding.diameter_px = 2 * axes.major_px;
  finding.axis_ratio = axes.minor_px / axes.major_px;
  finding.contrast = std::abs(fit.background_grey - fit.mark_grey);
  const double noise = fit.flat_rms > 0 ? fit.flat_rms : 0.02 * finding.contrast;
  const double excess = std::max(0.0, fit.edge_rms * fit.edge_rms - noise * noise);
  const double allowed = plain_model_share * finding.contrast;
  finding.quality = 1 / (1 + excess / (allowed * allowed));
  return finding;
}

// Residuals across the outline: noise as in the flat rings, and a small share of the contrast. And the
// outline is where the region was.
bool explains(const EllipseFit& fit, const MarkFinding& finding, const EllipseStart& start,
              double model_share) {
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

}  // namespace

MarkFinding fit_mark(const ImageView& image, const MarkSearch& search, const EllipseStart& start,
                     EllipseWorkspace& workspace, double model_share) {
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
  } else if (!explains(fit, finding, start, model_share) ||
             bright != search.bright) {
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

}  // namespace zeropose
