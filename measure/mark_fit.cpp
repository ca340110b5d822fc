#include "measure/mark_fit.h"

#include <algorithm>
#include <cmath>

#include "measure/covered_fit.h"
#include "measure/mark_verdict.h"

namespace zeropose {
namespace {

constexpr double clear_contrast = 20;  // in units of the noise: shows well what is no ellipse

bool band_in_image(const ImageView& image, const EllipseStart& start) {
  const double u = std::sqrt(start.shape_px2(0, 0)) + start.band_px + 0.5;
  const double v = std::sqrt(start.shape_px2(1, 1)) + start.band_px + 0.5;
  return start.centre_px.x() - u >= 0 && start.centre_px.x() + u <= image.width_px - 1 &&
         start.centre_px.y() - v >= 0 && start.centre_px.y() + v <= image.height_px - 1;
}

FitEvidence evidence_of(const EllipseFit& fit) {
  return {std::abs(fit.background_grey - fit.mark_grey),
          fit.edge_rms,
          fit.flat_rms,
          fit.outline_px,
          fit.outline_noise_px,
          std::sqrt(2 / fit.edge_count + 2 / std::max(1.0, fit.flat_count))};
}

MarkFinding finding_of(const EllipseFit& fit) {
  const HalfAxes axes = half_axes(fit.shape_px2);
  MarkFinding finding;
  finding.u_px = fit.centre_px;
  finding.covariance_px2 = fit.covariance_px2;
  finding.shape_px2 = fit.shape_px2;
  finding.diameter_px = 2 * axes.major_px;
  finding.axis_ratio = axes.minor_px / axes.major_px;
  finding.direction_rad = axes.angle_rad;
  finding.contrast = std::abs(fit.background_grey - fit.mark_grey);
  finding.blur_px = fit.blur_px;
  finding.outline_share = 1;
  finding.quality = quality_of(evidence_of(fit));
  return finding;
}

bool explains(const EllipseFit& fit, const FitTolerance& tolerance) {
  return pixels_agree(evidence_of(fit), tolerance.model_share, tolerance.noise_grey);
}

// The outline is where the search saw it.
bool in_place(const EllipseFit& fit, const EllipseStart& start, double room_share) {
  const double before = half_axes(start.shape_px2).major_px, after = half_axes(fit.shape_px2).major_px;
  const double room = 1 + room_share * before;
  return (fit.centre_px - start.centre_px).norm() < room && std::abs(after - before) < room;
}

MarkStatus status_of(const EllipseFit& fit, const MarkFinding& finding, const MarkSearch& search,
                     bool explained) {
  if (fit.saturated_share > saturated_share) return MarkStatus::saturated;
  if (!explained || !fit.settled || (fit.mark_grey > fit.background_grey) != search.bright)
    return MarkStatus::not_converged;
  if (finding.contrast < search.min_contrast) return MarkStatus::low_contrast;
  if (finding.blur_px > search.max_blur_px) return MarkStatus::blurred;
  if (finding.diameter_px < search.min_diameter_px) return MarkStatus::too_small;
  if (finding.diameter_px > search.max_diameter_px || finding.axis_ratio < search.min_axis_ratio)
    return MarkStatus::no_candidate;
  return MarkStatus::found;
}

MarkFinding failed(MarkStatus status) {
  MarkFinding finding;
  finding.status = status;
  return finding;
}

}  // namespace

MarkFinding fit_mark(const ImageView& image, const MarkSearch& search, const EllipseStart& start,
                     EllipseWorkspace& workspace, const FitTolerance& tolerance) {
  if (!band_in_image(image, start)) return failed(MarkStatus::cut_off);
  const EllipseFit fit = fit_ellipse(image, start, workspace);
  if (!fit.converged) return failed(MarkStatus::not_converged);
  MarkFinding finding = finding_of(fit);
  finding.status = status_of(fit, finding, search, explains(fit, tolerance) && in_place(fit, start, 0.05));
  return finding;
}

MarkFinding fit_covered_mark(const ImageView& image, const MarkSearch& search, const EllipseStart& start,
                             EllipseWorkspace& workspace, const FitTolerance& tolerance) {
  if (!band_in_image(image, start)) return failed(MarkStatus::cut_off);
  const CoveredFit covered = fit_covered_ellipse(image, start, plain_model_share, workspace);
  if (!covered.fit.converged) return failed(MarkStatus::not_converged);
  MarkFinding finding = finding_of(covered.fit);
  finding.outline_share = covered.outline_share;
  finding.quality *= covered.outline_share;
  const bool clear = finding.contrast > clear_contrast * covered.noise_grey;
  const bool explained = covered.outline_share >= (clear ? 0.5 : 0.6) && covered.gaps <= (clear ? 8 : 4) &&
                         covered.waves_px < rough_px && covered.noise_grey < tolerance.noise_grey &&
                         explains(covered.fit, tolerance) && in_place(covered.fit, start, 0.2);
  finding.status = status_of(covered.fit, finding, search, explained);
  return finding;
}

}  // namespace zeropose
