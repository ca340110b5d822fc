#include "measure/edge_mark_judge.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "measure/mark_verdict.h"

namespace zeropose {
namespace {

constexpr int least_side_px = 8;            // of a window
constexpr std::size_t lines_for_all = 120;  // each takes a look at all points that are left
constexpr double rival_strength = 0.5;      // of the best one's: then it is a rival
constexpr double same_px = 1, same_rad = 0.1;
constexpr double most_sigma_px = 0.3;  // of a place that counts

bool passed(const JudgedMark& mark) { return stands(mark.finding); }

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
    const bool better =
        passed(mark) == passed(best)
            ? (passed(mark) ? mark.strength > best.strength : telling(mark.finding) > telling(best.finding))
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

}  // namespace

OpenedWindow open_window(const ImageView& image, const MarkSearch& search, bool limits_sizes) {
  OpenedWindow opened;
  opened.status = MarkStatus::outside_image;
  if (image.data == nullptr || image.width_px < 2 || image.height_px < 2) return opened;
  opened.status = MarkStatus::not_searched;
  if (!place_makes_sense(search) || !directions_make_sense(search) ||
      !std::isfinite(search.min_diameter_px) || !std::isfinite(search.max_diameter_px) ||
      (limits_sizes && !sizes_make_sense(search))) {
    return opened;
  }
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
  const FitEvidence evidence{finding.contrast,     fit.edge_rms,
                             fit.flat_rms,         fit.outline_px,
                             fit.outline_noise_px, std::sqrt(4 / std::max(1.0, fit.pixels))};
  finding.quality = fit.converged ? quality_of(evidence) : 0;
  if (!fit.converged) {
    finding.status = MarkStatus::not_converged;
  } else if (fit.saturated_share > saturated_share) {
    finding.status = MarkStatus::saturated;
  } else if (!pixels_agree(evidence, plain_model_share, std::numeric_limits<double>::infinity())) {
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

MarkSight sight_of(std::vector<JudgedMark> marks, const GreyWindow& window, const MarkSearch& search,
                   HowMany wanted) {
  MarkSight sight;
  sight.nearest = chosen_mark(marks, window, search);
  std::stable_sort(marks.begin(), marks.end(),
                   [](const JudgedMark& a, const JudgedMark& b) { return a.strength > b.strength; });
  if (wanted.one() && stands(sight.nearest)) sight.standing = {sight.nearest};
  if (wanted.one()) return sight;
  for (const JudgedMark& mark : marks) {
    const bool known = std::any_of(sight.standing.begin(), sight.standing.end(),
                                   [&](const MarkFinding& other) { return same_mark(mark.finding, other); });
    if (passed(mark) && sure_place(mark.finding, search.kind) && !known)
      sight.standing.push_back(mark.finding);
  }
  std::stable_sort(sight.standing.begin(), sight.standing.end(),
                   [](const MarkFinding& a, const MarkFinding& b) { return a.contrast > b.contrast; });
  return sight;
}

double wrapped_line_rad(double angle_rad) { return std::remainder(angle_rad, std::numbers::pi); }

Eigen::Vector2d to_image(const GreyWindow& window, const Eigen::Vector2d& at) {
  return at + Eigen::Vector2d(window.pixels.u0, window.pixels.v0);
}

Eigen::Vector2d to_window(const GreyWindow& window, const Eigen::Vector2d& u_px) {
  return u_px - Eigen::Vector2d(window.pixels.u0, window.pixels.v0);
}

LineLimits line_limits_of(const MarkSearch& search, HowMany wanted, std::size_t lines_for_one) {
  LineLimits limits;
  limits.most = wanted.one() ? lines_for_one : lines_for_all;
  limits.all_pieces = !wanted.one();
  limits.min_contrast = search.min_contrast;
  limits.max_blur_px = search.max_blur_px;
  return limits;
}

}  // namespace zeropose
