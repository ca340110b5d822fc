#include "measure/mark_candidates.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <optional>

namespace zeropose {
namespace {

constexpr double finest_step = 3;     // grey levels
constexpr double size_margin_px = 2;  // the region at one level against the fitted outline

constexpr std::size_t most_groups = 2000;  // things kept apart
constexpr double flatten_share = 0.5;      // of the least contrast: what the light may fall off over a mark

// As coarse as the smallest mark allows: ten pixels across are enough to know it.
int reduction_for(const MarkSearch& search) {
  int reduction = 1;
  while (reduction < 8 && search.min_diameter_px >= 20 * reduction) reduction *= 2;
  return reduction;
}

template <typename Pixel>
double sample(const ImageView& image, const Eigen::Vector2d& at) {
  const double u = std::clamp(at.x(), 0.0, image.width_px - 1.001);
  const double v = std::clamp(at.y(), 0.0, image.height_px - 1.001);
  const int iu = static_cast<int>(u), iv = static_cast<int>(v);
  const double fu = u - iu, fv = v - iv;
  const Pixel *above = image.row<Pixel>(iv) + iu, *below = image.row<Pixel>(iv + 1) + iu;
  return image.grey_per_count() *
         ((1 - fv) * ((1 - fu) * above[0] + fu * above[1]) + fv * ((1 - fu) * below[0] + fu * below[1]));
}

// Directions all round.
constexpr std::size_t directions = 32;
using Circle = std::array<Eigen::Vector2d, directions>;

const Circle& unit_circle() {
  static const Circle circle = [] {
    Circle points;
    for (std::size_t k = 0; k < directions; ++k) {
      const double angle = 2 * std::numbers::pi * double(k) / directions;
      points[k] = {std::cos(angle), std::sin(angle)};
    }
    return points;
  }();
  return circle;
}

// Grey levels on both sides of an outline.
struct Sides {
  double inside = 0, outside = 0;  // medians
  double sound_share = 0;  // of the directions with at least half of the median contrast, in its sense
};

template <typename Pixel>
Sides sides_of(const ImageView& image, const Eigen::Vector2d& centre_px, const Eigen::Matrix2d& shape_px2) {
  const HalfAxes axes = half_axes(shape_px2);
  const Eigen::Vector2d major(std::cos(axes.angle_rad), std::sin(axes.angle_rad));
  const Eigen::Vector2d minor(-major.y(), major.x());
  const double inwards = std::min(2.5, 0.6 * axes.minor_px);
  std::array<double, directions> in{}, out{};
  for (std::size_t k = 0; k < directions; ++k) {
    const double c = unit_circle()[k].x(), s = unit_circle()[k].y();
    const Eigen::Vector2d on = axes.major_px * c * major + axes.minor_px * s * minor;
    const Eigen::Vector2d normal = (axes.minor_px * c * major + axes.major_px * s * minor).normalized();
    in[k] = sample<Pixel>(image, centre_px + on - inwards * normal);
    out[k] = sample<Pixel>(image, centre_px + on + 2.5 * normal);
  }
  const auto median = [](std::array<double, directions> values) {
    std::nth_element(values.begin(), values.begin() + directions / 2, values.end());
    return values[directions / 2];
  };
  Sides sides{median(in), median(out), 0};
  const double contrast = sides.outside - sides.inside;
  int sound = 0;
  for (std::size_t k = 0; k < directions; ++k) sound += (out[k] - in[k]) / contrast > 0.5 ? 1 : 0;
  sides.sound_share = sound / double{directions};
  return sides;
}

}  // namespace

CandidateSearch CandidateFinder::first(const ImageView& image, const PixelWindow& window,
                                       const MarkSearch& search, const LevelPlan& plan) {
  reduced_.prepare(image, window, reduction_for(search));
  return start(image, search, plan);
}

std::optional<CandidateSearch> CandidateFinder::flattened(const ImageView& image, const MarkSearch& search,
                                                          const LevelPlan& plan) {
  if (!reduced_.flatten(flatten_share * search.min_contrast, search.max_diameter_px)) return std::nullopt;
  return start(image, search, plan);
}

CandidateSearch CandidateFinder::start(const ImageView& image, const MarkSearch& search,
                                       const LevelPlan& plan) {
  groups_.clear();
  crowded_ = false;
  reason_ = MarkStatus::no_candidate;
  histogram_ = GreyHistogram(reduced_, search);
  low_ = histogram_.low();
  high_ = histogram_.high();
  step_ = 0;
  if (high_ - low_ < search.min_contrast) return {{}, MarkStatus::low_contrast, false, 0};
  const double wanted = std::ceil((high_ - low_) / std::max(finest_step, plan.widest_step_grey));
  step_ = (high_ - low_) / std::min(wanted, double(plan.most_levels));
  return look(image, search, low_ + step_ / 2);
}

std::optional<CandidateSearch> CandidateFinder::finer(const ImageView& image, const MarkSearch& search) {
  if (step_ < 2 * finest_step) return std::nullopt;
  step_ /= 2;
  return look(image, search, low_ + step_ / 2);
}

CandidateSearch CandidateFinder::look(const ImageView& image, const MarkSearch& search, double first_level) {
  const double room = shift_share * step_;
  for (double level = first_level; level < high_; level += step_)
    look_at_level(search, histogram_.quietest_near(level, room));
  CandidateSearch result = judge(image, search);
  result.crowded = crowded_;
  result.step_grey = step_grey_by_step * step_;
  return result;
}

void CandidateFinder::look_at_level(const MarkSearch& search, int level) {
  const auto suggest = [this](MarkStatus status) {  // a small one says less than one that is cut
    if (status == MarkStatus::cut_off || reason_ == MarkStatus::no_candidate) reason_ = status;
  };
  const double scale = reduced_.reduction();  // all below in pixels of the image
  const double largest = search.max_diameter_px + size_margin_px * scale;
  const BlobLimits limits{std::max(4.0, 0.4 * search.min_diameter_px / scale), largest / scale};
  for (const Blob& blob : blobs_.find(reduced_, level, search.bright, limits)) {
    const double longest = scale * std::max(blob.box.width(), blob.box.height());
    const double box_area = double(blob.box.width()) * blob.box.height();
    if (blob.touches_window) {
      if (longest > 0.6 * search.min_diameter_px && double(blob.area) > 0.65 * box_area)
        suggest(MarkStatus::cut_off);
      continue;
    }
    const HalfAxes axes = half_axes(scale * scale * blob.shape_px2);
    if (!(blob.misfit_px < 0.5 + 0.01 * axes.major_px / scale) ||
        axes.minor_px < (search.min_axis_ratio - 0.1) * axes.major_px || 2 * axes.major_px > largest)
      continue;
    if (2 * axes.major_px < search.min_diameter_px - size_margin_px * scale || axes.minor_px < 1.8) {
      if (2 * axes.major_px > 0.6 * search.min_diameter_px) suggest(MarkStatus::too_small);
      continue;
    }
    add({reduced_.in_image(blob.centre_px), scale * scale * blob.shape_px2, axes.major_px, axes.minor_px,
         level});
  }
}

// The same thing at another level has nearly the same centre and size.
void CandidateFinder::add(const Sighting& sighting) {
  for (Group& group : groups_) {
    const Sighting& known = group.back();
    const double ratio = sighting.major_px / known.major_px;
    if ((sighting.centre_px - known.centre_px).norm() < 0.3 * known.minor_px && ratio > 0.75 &&
        ratio < 1.33) {
      group.push_back(sighting);
      return;
    }
  }
  if (groups_.size() < most_groups) {
    groups_.push_back({sighting});
  } else {
    crowded_ = true;
  }
}

CandidateSearch CandidateFinder::judge(const ImageView& image, const MarkSearch& search) {
  CandidateSearch result{{}, reason_, false, 0};
  const double sign = search.bright ? -1 : 1;
  const auto sides_at = [&image](const Sighting& seen) {
    return image.two_bytes() ? sides_of<std::uint16_t>(image, seen.centre_px, seen.shape_px2)
                             : sides_of<std::uint8_t>(image, seen.centre_px, seen.shape_px2);
  };
  for (Group& group : groups_) {
    std::sort(group.begin(), group.end(),
              [](const Sighting& a, const Sighting& b) { return a.level < b.level; });
    const Sighting* best = &group[group.size() / 2];
    Sides sides = sides_at(*best);
    const double middle = 0.5 * (sides.inside + sides.outside);
    const Sighting* const first = best;
    for (const Sighting& other : group) {
      if (std::abs(other.level - middle) < std::abs(best->level - middle)) best = &other;
    }
    if (best != first) sides = sides_at(*best);
    const double contrast = sign * (sides.outside - sides.inside);
    if (!(contrast > 0) || sides.sound_share < 0.85) continue;
    if (contrast < search.min_contrast) {
      result.reason = MarkStatus::low_contrast;
      continue;
    }
    result.candidates.push_back({{best->centre_px, best->shape_px2, sides.inside, sides.outside}, contrast});
  }
  std::stable_sort(result.candidates.begin(), result.candidates.end(),
                   [](const MarkCandidate& a, const MarkCandidate& b) { return a.contrast > b.contrast; });
  return result;
}

}  // namespace zeropose
