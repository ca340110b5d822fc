#include "measure/pattern.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "measure/pattern_level.h"
#include "measure/small_cholesky.h"

namespace zeropose {
namespace {

constexpr double saturated_share = 0.02;
constexpr double least_contrast = 4, contrast_by_noise = 2;
constexpr double most_sigma_px = 0.1;     // of the patch's middle
constexpr double most_sigma_ratio = 15;   // worst by best direction
constexpr double farthest_diagonals = 1;  // of the clicked point from the middle
constexpr double rounding_variance = 1.0 / 12;

constexpr std::size_t taps = 5;
constexpr float fourth_difference[taps] = {1, -4, 6, -4, 1};

// Fourth differences both ways see little but noise, since lenses leave hardly any structure that fine; half
// of them are below 0.6745 sigma times the mask's norm of 70, whatever a few strong edges add.
double noise_of(const GreyField& patch) {
  const int w = patch.width - 4, h = patch.height - 4;
  std::vector<float> line(std::size_t(patch.width)), sizes;
  sizes.reserve(std::size_t(w) * std::size_t(h));
  for (int v = 0; v < h; ++v) {
    std::fill(line.begin(), line.end(), 0.0F);
    for (int k = 0; k < 5; ++k) {
      const float* const row = patch.row(v + k);
      for (std::size_t u = 0; u < line.size(); ++u) line[u] += fourth_difference[k] * row[u];
    }
    for (std::size_t u = 0; u < std::size_t(w); ++u) {
      float sum = 0;
      for (std::size_t k = 0; k < taps; ++k) sum += fourth_difference[k] * line[u + k];
      sizes.push_back(std::abs(sum));
    }
  }
  const auto middle = sizes.begin() + std::ptrdiff_t(sizes.size() / 2);
  std::nth_element(sizes.begin(), middle, sizes.end());
  return std::max(double{*middle} / (0.6745 * 70), std::sqrt(rounding_variance));
}

double share_of_white(const ImageView& image, const PixelWindow& window) {
  double white = 0;
  for (int v = window.v0; v <= window.v1; ++v) {
    for (int u = window.u0; u <= window.u1; ++u) white += image.grey_at(u, v) >= 254.999 ? 1 : 0;
  }
  return white / (double(window.width()) * window.height());
}

// Worst and best standard deviation over the directions.
std::pair<double, double> extreme_sigmas(const Eigen::Matrix2d& C) {
  const double mean = 0.5 * C.trace(), spread = std::hypot(0.5 * (C(0, 0) - C(1, 1)), C(0, 1));
  return {std::sqrt(mean + spread), std::sqrt(std::max(0.0, mean - spread))};
}

// Whether matches of the patch will be certain in all directions; sets the pattern's sigma.
PatternStatus judge_structure(const PatternLevel& level, Pattern& pattern) {
  const double noise2 = pattern.noise_grey * pattern.noise_grey;
  pattern.contrast = 2 * std::sqrt(std::max(0.0, level.variance_grey2 - noise2));
  if (pattern.contrast < std::max(least_contrast, contrast_by_noise * pattern.noise_grey)) {
    return PatternStatus::flat;
  }
  MatchMatrix N = information_of(level, level.counts) - noise2 * slope_noise_of(level);
  const double typical = 0.5 * (N(0, 0) + N(1, 1));
  for (int k = 0; k < match_unknowns; ++k) N(k, k) += 1e-6 * (k < 6 ? typical : N(k, k));
  const Eigen::Matrix2d shift = N.topLeftCorner<2, 2>();
  const auto [most, least] = extreme_sigmas(shift);  // roots of the information in its directions
  if (!(least * most_sigma_ratio > most)) return PatternStatus::one_direction;
  const SmallCholesky<match_unknowns> solver(N);
  if (!solver.ok()) return PatternStatus::one_direction;
  const MatchMatrix C = 2 * noise2 * solver.inverse();
  const auto [worst, best] = extreme_sigmas(C.topLeftCorner<2, 2>());
  const auto M = motion_of(pattern.clicked_px - level.middle_px);
  pattern.sigma_px = extreme_sigmas(M * C * M.transpose()).first;
  if (best > most_sigma_px) return PatternStatus::flat;
  return worst > most_sigma_px || worst > most_sigma_ratio * best ? PatternStatus::one_direction
                                                                  : PatternStatus::taught;
}

PatternStatus judge(const ImageView& image, const PixelWindow& window, const GreyField& patch,
                    Pattern& pattern) {
  pattern.noise_grey = noise_of(patch);
  if (share_of_white(image, window) > saturated_share) return PatternStatus::saturated;
  const PatternLevel level(patch);
  const PatternStatus status = judge_structure(level, pattern);
  const double diagonal = std::hypot(patch.width, patch.height);
  const bool far = (pattern.clicked_px - level.middle_px).norm() > farthest_diagonals * diagonal;
  return status == PatternStatus::taught && far ? PatternStatus::point_too_far : status;
}

}  // namespace

std::string_view name_of(PatternStatus status) {
  switch (status) {
    case PatternStatus::not_taught:
      return "not_taught";
    case PatternStatus::taught:
      return "taught";
    case PatternStatus::outside_image:
      return "outside_image";
    case PatternStatus::too_small:
      return "too_small";
    case PatternStatus::saturated:
      return "saturated";
    case PatternStatus::flat:
      return "flat";
    case PatternStatus::one_direction:
      return "one_direction";
    case PatternStatus::point_too_far:
      return "point_too_far";
  }
  return "unknown";
}

Pattern teach_pattern(const ImageView& image, const PixelWindow& window, const Eigen::Vector2d& clicked_px) {
  Pattern pattern;
  pattern.status = PatternStatus::outside_image;
  if (image.data == nullptr || window.empty() || window.u0 < 0 || window.v0 < 0 ||
      window.u1 >= image.width_px || window.v1 >= image.height_px || !clicked_px.allFinite()) {
    return pattern;
  }
  pattern.status = PatternStatus::too_small;
  if (std::min(window.width(), window.height()) < smallest_pattern_px) return pattern;
  const GreyField patch = field_of(image, window);
  pattern.width_px = patch.width;
  pattern.height_px = patch.height;
  pattern.clicked_px = clicked_px - Eigen::Vector2d(window.u0, window.v0);
  pattern.status = judge(image, window, patch, pattern);
  pattern.greys = patch.grey;
  return pattern;
}

}  // namespace zeropose
