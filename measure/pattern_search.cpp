#include "measure/pattern_search.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "measure/mark_verdict.h"
#include "measure/pattern_fit.h"
#include "measure/pattern_peaks.h"

namespace zeropose {
namespace {

using Eigen::Matrix2d;
using Eigen::Vector2d;

constexpr int smallest_peak_patch = 9;                 // px, of the level where the search begins
constexpr double least_structure = 0.25;               // of the standard deviation that must be left there
constexpr double halved_noise = 0.3125;                // sigma of a pixel after halving
constexpr double worth_following = 0.5;                // of the best peak's correlation
constexpr double rival_promising = 0.75, alike = 0.6;  // correlations: to go on with; of something like it
constexpr double much_alike = 0.7;  // what stands out of the window must be, to be called the pattern
constexpr double least_correlation = 0.85, least_share = 0.7;
constexpr double stands_out_px = 1.5;
constexpr double scale_range = 0.12, least_squeeze = 0.85, turn_slack_rad = 0.02;
constexpr double blurred_px2 = 0.5;
constexpr double most_sigma_px = 0.3;

MarkFinding finding_with(MarkStatus status) {
  MarkFinding finding;
  finding.status = status;
  return finding;
}

bool usable(const Pattern* pattern) {
  return pattern != nullptr && pattern->status == PatternStatus::taught &&
         std::min(pattern->width_px, pattern->height_px) >= smallest_pattern_px &&
         pattern->greys.size() == std::size_t(pattern->width_px) * std::size_t(pattern->height_px) &&
         pattern->clicked_px.allFinite() && pattern->noise_grey > 0;
}

bool makes_sense(const MarkSearch& s) {
  return usable(s.pattern) && place_makes_sense(s) && directions_make_sense(s);
}

double tolerance_of(const MarkSearch& search) {
  return search.direction_tolerance_rad >= std::numbers::pi ? plain_pattern_turn_rad
                                                            : search.direction_tolerance_rad;
}

double angle_between(double a, double b) { return std::remainder(a - b, 2 * std::numbers::pi); }

double sigma_of(const GreyField& field) {
  const Eigen::Map<const Eigen::ArrayXf> greys(field.grey.data(), Eigen::Index(field.grey.size()));
  return std::sqrt(double{(greys - greys.mean()).square().mean()});
}

// The patch in full size and smaller, down to where the search begins.
std::vector<GreyField> patches_of(const Pattern& pattern) {
  std::vector<GreyField> patches{field_of(pattern)};
  const double least = least_structure * sigma_of(patches.front());
  while (std::min(patches.back().width, patches.back().height) / 2 >= smallest_peak_patch) {
    GreyField smaller = halved(patches.back());
    if (sigma_of(smaller) < least) break;
    patches.push_back(std::move(smaller));
  }
  return patches;
}

// Between a level and the one of half its size; middles of the patches, which lose an odd last pixel.
PatternWarp to_larger(const PatternWarp& warp, const GreyField& small, const GreyField& large) {
  const Vector2d small_middle = Vector2d(small.width, small.height), large_middle(large.width, large.height);
  PatternWarp larger = warp;
  larger.middle_px =
      2 * warp.middle_px + Vector2d::Constant(0.5) + warp.linear * (0.5 * large_middle - small_middle);
  return larger;
}

// Something that may be the pattern, in px of the region.
struct PatternCandidate {
  PatternWarp warp;
  double correlation = 0;
};

class PatternSearcher {
 public:
  PatternSearcher(const ImageView& image, const MarkSearch& search)
      : image_(image), search_(search), pattern_(*search.pattern), window_(window_of(image, search)) {}

  MarkFinding run();

 private:
  void cut_region();
  std::vector<PatternCandidate> candidates() const;
  PatternCandidate followed(PatternWarp warp, double correlation) const;
  MarkFinding measured(const PatternCandidate& candidate, const PatternLevel& level) const;
  void describe(const PatternFit& fit, MarkFinding& finding) const;
  MarkStatus judge(const PatternFit& fit, const MarkFinding& finding) const;
  bool stands_out(const PatternFit& fit) const;

  const ImageView& image_;
  const MarkSearch& search_;
  const Pattern& pattern_;
  PixelWindow window_;
  PixelWindow region_{};  // the window and what a patch that stands out of it needs
  std::vector<GreyField> patches_{}, fields_{};
  std::vector<PatternLevel> levels_{};  // between first and last
};

void PatternSearcher::cut_region() {
  const int u = pattern_.width_px / 4, v = pattern_.height_px / 4;
  region_ = {window_.u0 - u, window_.v0 - v, window_.u1 + u, window_.v1 + v};
  patches_ = patches_of(pattern_);
  fields_.push_back(field_of(image_, region_));
  while (fields_.size() < patches_.size()) fields_.push_back(halved(fields_.back()));
  for (std::size_t k = 1; k + 1 < patches_.size(); ++k) levels_.emplace_back(patches_[k]);
}

// From the smallest level to the full one, matching at those between.
PatternCandidate PatternSearcher::followed(PatternWarp warp, double correlation) const {
  for (std::size_t k = patches_.size() - 1; k > 0; --k) {
    warp = to_larger(warp, patches_[k], patches_[k - 1]);
    if (k == 1) break;
    const double noise = pattern_.noise_grey * std::pow(halved_noise, double(k - 1));
    const PatternFit fit = match_level(levels_[k - 2], fields_[k - 1], warp, noise,
                                       {.most_iterations = 6, .last_step_sigmas = 0.5});
    if (fit.used_share > 0.5 && std::abs(scale_of(fit.warp) - 1) < 0.3 && squeeze_of(fit.warp) > 0.7) {
      warp = fit.warp;
    }
    correlation = fit.correlation;
  }
  return {warp, correlation};
}

// Best first.
std::vector<PatternCandidate> PatternSearcher::candidates() const {
  const double least_sigma =
      0.05 * search_.min_contrast * sigma_of(patches_.back()) / sigma_of(patches_.front());
  std::vector<PatternCandidate> found;
  double best_peak = 0;
  for (const PatternPeak& peak : pattern_peaks(fields_.back(), patches_.back(),
                                               {.rotation_rad = search_.direction_rad,
                                               .tolerance_rad = tolerance_of(search_),
                                               .least_sigma = least_sigma})) {
    if (!found.empty() && peak.correlation < worth_following * best_peak) continue;
    best_peak = std::max(best_peak, peak.correlation);
    found.push_back(followed(peak.warp, peak.correlation));
  }
  std::stable_sort(found.begin(), found.end(), [](const PatternCandidate& a, const PatternCandidate& b) {
    return a.correlation > b.correlation;
  });
  return found;
}

bool PatternSearcher::stands_out(const PatternFit& fit) const {
  const Vector2d half =
      0.5 * (fit.warp.linear.cwiseAbs() * Vector2d(pattern_.width_px - 1, pattern_.height_px - 1));
  const Vector2d low = fit.warp.middle_px - half, high = fit.warp.middle_px + half;
  return fit.seen_share < 0.995 || low.x() < window_.u0 - stands_out_px ||
         low.y() < window_.v0 - stands_out_px || high.x() > window_.u1 + stands_out_px ||
         high.y() > window_.v1 + stands_out_px;
}

void PatternSearcher::describe(const PatternFit& fit, MarkFinding& finding) const {
  const Vector2d half = 0.5 * Vector2d(pattern_.width_px, pattern_.height_px);
  const Matrix2d axes = fit.warp.linear * half.asDiagonal();
  finding.u_px = clicked_place(pattern_, fit);
  finding.covariance_px2 = clicked_covariance(pattern_, fit);
  finding.diameter_px = 2 * half.maxCoeff() * scale_of(fit.warp);
  finding.axis_ratio = squeeze_of(fit.warp);
  finding.direction_rad = rotation_of(fit.warp);
  finding.contrast = std::max(0.0, fit.gain * pattern_.contrast);
  finding.blur_px = std::sqrt(std::max(0.0, fit.blur_px2));
  finding.quality = std::pow(std::clamp(fit.correlation, 0.0, 1.0), 2);
  finding.outline_share = fit.used_share;
  finding.shape_px2 = axes * axes.transpose();
}

MarkStatus PatternSearcher::judge(const PatternFit& fit, const MarkFinding& finding) const {
  if (!(fit.correlation >= alike)) return MarkStatus::no_candidate;
  if (fit.saturated_share > saturated_share) return MarkStatus::saturated;
  if (stands_out(fit) && fit.correlation > much_alike) return MarkStatus::cut_off;
  if (!fit.converged) return MarkStatus::not_converged;
  if (!(finding.contrast >= search_.min_contrast)) return MarkStatus::low_contrast;
  const double scale = scale_of(fit.warp), turn = angle_between(finding.direction_rad, search_.direction_rad);
  if (scale < 1 - scale_range) return MarkStatus::too_small;
  if (scale > 1 + scale_range || finding.axis_ratio < least_squeeze ||
      std::abs(turn) > tolerance_of(search_) + turn_slack_rad) {
    return MarkStatus::no_candidate;
  }
  if (!(finding.blur_px <= search_.max_blur_px)) return MarkStatus::blurred;
  if (!(fit.correlation >= least_correlation)) {
    return fit.blur_px2 > blurred_px2 ? MarkStatus::blurred : MarkStatus::not_converged;
  }
  if (!(fit.used_share >= least_share)) return MarkStatus::not_converged;
  if (!(finding.covariance_px2.trace() < most_sigma_px * most_sigma_px)) return MarkStatus::low_contrast;
  return MarkStatus::found;
}

MarkFinding PatternSearcher::measured(const PatternCandidate& candidate, const PatternLevel& level) const {
  PatternWarp start = candidate.warp;
  start.middle_px += Vector2d(region_.u0, region_.v0);
  const PatternFit fit = fit_pattern(image_, pattern_, level, start);
  MarkFinding finding;
  if (fit.iterations > 0) describe(fit, finding);
  finding.status = judge(fit, finding);
  return finding;
}

// How near to a found one a failed one came: what was measured at all says more than a limit of size or turn.
int nearness(const MarkFinding& finding) {
  switch (finding.status) {
    case MarkStatus::no_candidate:
      return 1;
    case MarkStatus::not_converged:
      return 2;
    default:
      return 3;
  }
}

// A second place counts where it explains its pixels nearly as well.
bool rivals(const MarkFinding& a, const MarkFinding& b) {
  const double unlike_a = 1 - std::sqrt(a.quality), unlike_b = 1 - std::sqrt(b.quality);
  // Two fits of one place agree far better than this.
  constexpr double apart_px = 2;
  return (a.u_px - b.u_px).norm() > apart_px &&
         std::max(unlike_a, unlike_b) < 0.05 + 4 * std::min(unlike_a, unlike_b);
}

bool better(const MarkFinding& a, const MarkFinding& b) {
  const bool found_a = a.status == MarkStatus::found, found_b = b.status == MarkStatus::found;
  if (found_a != found_b) return found_a;
  if (found_a || nearness(a) == nearness(b)) return a.quality > b.quality;
  return nearness(a) > nearness(b);
}

MarkFinding PatternSearcher::run() {
  if (window_.empty()) return finding_with(MarkStatus::outside_image);
  if (window_.width() < pattern_.width_px - 2 || window_.height() < pattern_.height_px - 2) {
    return finding_with(MarkStatus::cut_off);
  }
  cut_region();
  const PatternLevel level(patches_.front());
  MarkFinding best = finding_with(MarkStatus::no_candidate);
  bool ambiguous = false;
  for (const PatternCandidate& candidate : candidates()) {
    if (candidate.correlation < rival_promising && best.status == MarkStatus::found) break;
    const MarkFinding finding = measured(candidate, level);
    ambiguous = ambiguous || (finding.status == MarkStatus::found && best.status == MarkStatus::found &&
                              rivals(finding, best));
    if (better(finding, best)) best = finding;
  }
  if (ambiguous) best.status = MarkStatus::ambiguous;
  return best;
}

}  // namespace

MarkFinding find_pattern(const ImageView& image, const MarkSearch& search) {
  if (image.data == nullptr || image.width_px < 2 || image.height_px < 2) {
    return finding_with(MarkStatus::outside_image);
  }
  if (!makes_sense(search)) return {};
  return PatternSearcher(image, search).run();
}

}  // namespace zeropose
