#include "measure/tyre_profile.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <optional>

#include "measure/profile_spline.h"

namespace zeropose {
namespace {

using Eigen::Vector3d;

constexpr double step_mm = 0.2;
constexpr int bisections = 40;

struct Sighted {
  double radius_mm;
  const SidePoint* point;
};

class Line {
 public:
  Line(const SideLine& line, const WheelAxis& axis, const ProfileSearch& search)
      : axis_(axis), search_(search) {
    for (const SidePoint& point : line) {
      const WheelAxis::Place place = axis.place(point.p_W_mm);
      samples_.push_back({place.radius_mm, place.height_mm, point.sigma_along(axis.n_W)});
      sighted_.push_back({place.radius_mm, &point});
    }
    std::ranges::sort(sighted_, {}, &Sighted::radius_mm);
    if (sighted_.empty()) return;
    // At the same radii on all lines, so that what the spline cannot follow is alike on all of them.
    const double spacing = search.knot_spacing_mm;
    const SplineKnots knots(spacing * std::floor(from() / spacing),
                            spacing * (std::floor(to() / spacing) + 1), spacing);
    if (std::ssize(samples_) > 2 * knots.coefficients())
      spline_.emplace(samples_, knots, search.neighbours_gain);
  }

  std::vector<ProfileExtreme> extremes() const {
    std::vector<double> radii;
    if (!spline_) return {};
    for (double r = from(); r + step_mm < to(); r += step_mm)
      if ((slope(r) < 0) != (slope(r + step_mm) < 0)) radii.push_back(root(r, r + step_mm));
    std::vector<ProfileExtreme> found;
    for (std::size_t i = 0; i < radii.size(); ++i) {
      const double before = i == 0 ? from() : radii[i - 1],
                   after = i + 1 == radii.size() ? to() : radii[i + 1];
      if (const auto extreme = judged(radii[i], before, after)) found.push_back(*extreme);
    }
    return found;
  }

 private:
  double from() const { return sighted_.front().radius_mm; }
  double to() const { return sighted_.back().radius_mm; }
  double slope(double r) const { return spline_->at(r).slope; }

  double root(double low, double high) const {
    const bool falls = slope(low) < 0;
    for (int i = 0; i < bisections; ++i) {
      const double middle = (low + high) / 2;
      ((slope(middle) < 0) == falls ? low : high) = middle;
    }
    return (low + high) / 2;
  }

  // The first point behind r, unless the points about r are too far from each other.
  std::optional<std::vector<Sighted>::const_iterator> after_gap(double r) const {
    const auto next = std::ranges::lower_bound(sighted_, r, {}, &Sighted::radius_mm);
    if (next == sighted_.begin() || next == sighted_.end()) return std::nullopt;
    if (next->radius_mm - (next - 1)->radius_mm > search_.most_gap_mm) return std::nullopt;
    return next;
  }

  // before, after: the extremes next to it, or the ends.
  std::optional<ProfileExtreme> judged(double r, double before, double after) const {
    if (r < from() + search_.margin_mm || r > to() - search_.margin_mm) return std::nullopt;
    const ProfileHeight height = spline_->at(r);
    const double rise = std::min(std::abs(height.height_mm - spline_->at(before).height_mm),
                                 std::abs(height.height_mm - spline_->at(after).height_mm));
    if (rise < std::max(search_.least_rise_mm, search_.least_rise_sigmas * height.sigma_mm))
      return std::nullopt;
    const auto next = after_gap(r);
    if (!next || !after_gap(r - search_.seen_about_mm) || !after_gap(r + search_.seen_about_mm))
      return std::nullopt;
    const Sighted &a = *(*next - 1), &b = **next;
    const double part = (r - a.radius_mm) / std::max(1e-9, b.radius_mm - a.radius_mm);
    const Vector3d near = a.point->p_W_mm + part * (b.point->p_W_mm - a.point->p_W_mm);
    const Vector3d p_W = axis_.p_W_mm + height.height_mm * axis_.n_W + r * axis_.place(near).outwards_W;
    // A knot's length of line tells the slope with about the height's sigma over that length.
    const double sigma_slope = 2 * height.sigma_mm / search_.knot_spacing_mm;
    return ProfileExtreme{height.bend_per_mm < 0,
                          r,
                          height.height_mm,
                          height.sigma_mm,
                          sigma_slope / std::max(1e-6, std::abs(height.bend_per_mm)),
                          height.bend_per_mm,
                          p_W};
  }

  const WheelAxis& axis_;
  const ProfileSearch& search_;
  std::vector<ProfileSample> samples_;
  std::vector<Sighted> sighted_;
  std::optional<ProfileSpline> spline_;
};

double median(std::vector<double> values) {
  std::ranges::nth_element(values, values.begin() + std::ssize(values) / 2);
  return values[values.size() / 2];
}

double mean_bend(const SharedProfile& profile) {
  double sum = 0;
  for (const ProfileExtreme& extreme : profile) sum += std::abs(extreme.bend_per_mm);
  return sum / static_cast<double>(profile.size());
}

struct Group {
  SharedProfile profile;
  std::vector<std::size_t> without;
};

const ProfileExtreme* nearest(const std::vector<ProfileExtreme>& line, const ProfileExtreme& to,
                              double radius_tolerance_mm, double height_tolerance_mm) {
  const ProfileExtreme* best = nullptr;
  double least = radius_tolerance_mm;
  for (const ProfileExtreme& extreme : line) {
    const double off = std::abs(extreme.radius_mm - to.radius_mm);
    if (extreme.heave != to.heave || off > least ||
        std::abs(extreme.height_mm - to.height_mm) > height_tolerance_mm)
      continue;
    least = off, best = &extreme;
  }
  return best;
}

}  // namespace

std::vector<ProfileExtreme> extremes_on_line(const SideLine& line, const WheelAxis& axis,
                                             const ProfileSearch& search) {
  return Line(line, axis, search).extremes();
}

SharedProfiles shared_by_all(std::span<const std::vector<ProfileExtreme>> lines, double radius_tolerance_mm,
                             double height_tolerance_mm) {
  const auto group_about = [&](ProfileExtreme about) {
    Group group;
    for (int round = 0; round < 2; ++round) {  // about one of them, then about their medians
      group = {};
      std::vector<double> radii, heights;
      for (std::size_t i = 0; i < lines.size(); ++i) {
        const auto* extreme = nearest(lines[i], about, radius_tolerance_mm, height_tolerance_mm);
        if (!extreme) {
          group.without.push_back(i);
          continue;
        }
        group.profile.push_back(*extreme);
        radii.push_back(extreme->radius_mm), heights.push_back(extreme->height_mm);
      }
      if (radii.empty()) break;
      about.radius_mm = median(radii), about.height_mm = median(heights);
    }
    return group;
  };
  SharedProfiles shared;
  std::vector<std::size_t> least_without(lines.size() + 1);
  for (const auto& line : lines) {
    for (const ProfileExtreme& seed : line) {
      Group group = group_about(seed);
      if (group.without.size() < least_without.size()) least_without = group.without;
      if (!group.without.empty()) continue;
      const bool known = std::ranges::any_of(shared.all, [&](const SharedProfile& profile) {
        return profile.front().radius_mm == group.profile.front().radius_mm;
      });
      if (!known) shared.all.push_back(std::move(group.profile));
    }
  }
  std::ranges::sort(shared.all, std::ranges::greater{}, mean_bend);
  if (shared.all.empty() && least_without.size() <= lines.size()) shared.lines_without = least_without;
  return shared;
}

}  // namespace zeropose
