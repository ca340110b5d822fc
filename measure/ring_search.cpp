#include "measure/ring_search.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <optional>

#include "measure/mark_fit.h"

namespace zeropose {
namespace {

constexpr std::size_t most_inner_discs = 1000;
constexpr double size_tolerance = 0.1;  // of the share of an inner circle
constexpr double centre_tolerance =
    0.04;  // between two circles, of the outer one's diameter: tilt moves them

// The search of the innermost disc.
MarkSearch innermost(const MarkSearch& ring) {
  MarkSearch search = ring;
  const double share = ring.inner_shares.back();
  search.kind = MarkKind::disc;
  search.bright = ring.bright != (ring.inner_shares.size() % 2 == 1);
  search.min_diameter_px = ring.min_diameter_px * share * (1 - size_tolerance);
  search.max_diameter_px = ring.max_diameter_px * share * (1 + size_tolerance);
  search.min_axis_ratio = ring.min_axis_ratio;
  return search;
}

// A good half of the narrowest wall beside the k-th circle belongs to its band.
double band_of(const std::vector<double>& shares, std::size_t k, double minor_px) {
  double wall = 1;
  if (k > 0) wall = std::min(wall, shares[k - 1] - shares[k]);
  if (k + 1 < shares.size()) wall = std::min(wall, shares[k] - shares[k + 1]);
  return std::min(EllipseStart{}.band_px, 0.6 * wall * minor_px);
}

// The circles from the outer one inwards, as far as they are there.
std::vector<MarkFinding> circles_round(const ImageView& image, const MarkSearch& search,
                                       const MarkFinding& inner, MarkWorkspace& workspace) {
  std::vector<double> shares{1};
  shares.insert(shares.end(), search.inner_shares.begin(), search.inner_shares.end());
  std::vector<MarkFinding> circles;
  for (std::size_t k = 0; k < shares.size(); ++k) {
    const double scale = shares[k] / shares.back();
    EllipseStart start;
    start.centre_px = inner.u_px;
    start.shape_px2 = scale * scale * inner.shape_px2;
    start.band_px = band_of(shares, k, half_axes(start.shape_px2).minor_px / shares[k]);
    MarkSearch circle = search;
    circle.kind = MarkKind::disc;
    circle.bright = search.bright != (k % 2 == 1);
    circle.min_diameter_px = (1 - size_tolerance) * scale * inner.diameter_px;
    circle.max_diameter_px = (1 + size_tolerance) * scale * inner.diameter_px;
    start.mark_grey = circle.bright ? 200 : 50;
    start.background_grey = circle.bright ? 50 : 200;
    circles.push_back(k + 1 == shares.size()
                          ? inner
                          : fit_mark(image, circle, start, workspace.ellipse, workspace.tolerance));
    if (circles.back().status == MarkStatus::not_converged)
      circles.back() = fit_covered_mark(image, circle, start, workspace.ellipse, workspace.tolerance);
    if (circles.back().status != MarkStatus::found) break;
  }
  return circles;
}

// One place from all circles.
MarkFinding joined(const std::vector<MarkFinding>& circles) {
  MarkFinding ring = circles.front();
  Eigen::Matrix2d information = Eigen::Matrix2d::Zero();
  Eigen::Vector2d sum = Eigen::Vector2d::Zero();
  double weights = 0, squares = 0;
  for (const MarkFinding& circle : circles) {
    const Eigen::Matrix2d W = circle.covariance_px2.inverse();
    information += W;
    sum += W * circle.u_px;
    const double share = circle.diameter_px / ring.diameter_px;
    weights += W.trace();
    squares += W.trace() * share * share;
    ring.contrast = std::min(ring.contrast, circle.contrast);
    ring.quality = std::min(ring.quality, circle.quality);
    ring.outline_share = std::min(ring.outline_share, circle.outline_share);
    ring.blur_px = std::max(ring.blur_px, circle.blur_px);
  }
  ring.covariance_px2 = information.inverse();
  ring.u_px = ring.covariance_px2 * sum;
  ring.radius_share = std::sqrt(squares / weights);
  return ring;
}

MarkFinding ring_about(const ImageView& image, const MarkSearch& search, const MarkFinding& inner,
                       MarkWorkspace& workspace) {
  const std::vector<MarkFinding> circles = circles_round(image, search, inner, workspace);
  MarkFinding ring = circles.front();
  if (circles.back().status != MarkStatus::found) {
    ring.status = circles.back().status;
    return ring;
  }
  for (const MarkFinding& circle : circles)
    if ((circle.u_px - ring.u_px).norm() > 0.5 + centre_tolerance * ring.diameter_px)
      ring.status = MarkStatus::no_candidate;
  if (ring.status != MarkStatus::found) return ring;
  ring = joined(circles);
  if (ring.diameter_px < search.min_diameter_px) ring.status = MarkStatus::too_small;
  if (ring.diameter_px > search.max_diameter_px) ring.status = MarkStatus::no_candidate;
  return ring;
}

}  // namespace

MarkSight look_for_rings(const ImageView& image, const PixelWindow& window, const MarkSearch& search,
                         MarkWorkspace& workspace) {
  // All of them: what is the best disc need not be in the best ring.
  const MarkSight inner = look_for_discs(image, window, innermost(search), {most_inner_discs}, workspace);
  MarkSight rings;
  rings.nearest = inner.nearest;
  rings.crowded = inner.crowded;
  for (const MarkFinding& disc : inner.standing)
    if (disc.status == MarkStatus::saturated) {
      rings.take(disc);
    } else {
      rings.take(ring_about(image, search, disc, workspace));
    }
  return rings;
}

}  // namespace zeropose
