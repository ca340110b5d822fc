#include "measure/line_search.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <optional>

#include "measure/edge_points.h"

namespace zeropose {
namespace {

constexpr double pi = std::numbers::pi;
constexpr int angle_bins = 180;  // of 2 degrees
constexpr int vote_bins = 4;     // to each side of a point's own direction
constexpr double bin_rad = 2 * pi / angle_bins;
constexpr double member_px = 2.5, member_rad = 0.4;
constexpr float member_cosine = 0.921F;
constexpr double side_px = 2.5;     // where the grey levels beside an edge are taken
constexpr double least_points = 6;  // of a line
constexpr double piece_gap_px = 3;  // points beside a piece that still are its own
constexpr double largest_tolerance_rad = 3.1;

// Votes by direction of the normal and offset from the window's middle.
class VoteTable {
 public:
  VoteTable(const GreyWindow& window)
      : middle_(0.5 * (window.width() - 1), 0.5 * (window.height() - 1)),
        half_(static_cast<int>(middle_.norm()) + 3),
        votes_(std::size_t(angle_bins) * std::size_t(2 * half_ + 2), 0.0F) {
    for (int k = 0; k < angle_bins; ++k)
      cosine_.push_back(std::cos(k * bin_rad)), sine_.push_back(std::sin(k * bin_rad));
  }

  // weight: negative to take it back.
  void add(const SlopePoint& p, float weight) {
    const int own = static_cast<int>(std::lround(std::atan2(p.ny, p.nx) / float(bin_rad)));
    for (int k = own - vote_bins; k <= own + vote_bins; ++k) {
      const auto bin = std::size_t((k + 2 * angle_bins) % angle_bins);
      const double rho = cosine_[bin] * (p.x - middle_.x()) + sine_[bin] * (p.y - middle_.y()) + half_;
      const auto at = static_cast<int>(rho);
      const auto part = static_cast<float>(rho - at);
      float* row = &votes_[bin * std::size_t(2 * half_ + 2) + std::size_t(at)];
      changed_[bin] = true;
      row[0] += weight * (1 - part);
      row[1] += weight * part;
    }
  }

  struct Peak {
    double normal_rad, offset_px;
    float votes;
  };
  Peak highest() {
    const std::size_t columns = std::size_t(2 * half_ + 2);
    std::size_t bin = 0;
    float most = -1;
    for (std::size_t k = 0; k < angle_bins; ++k) {
      if (changed_[k]) {
        const float* row = &votes_[k * columns];
        float highest = 0;
        for (std::size_t i = 0; i < columns; ++i) highest = std::max(highest, row[i]);
        highest_[k] = highest;
        changed_[k] = false;
      }
      if (highest_[k] > most) most = highest_[k], bin = k;
    }
    const auto* row = &votes_[bin * columns];
    const std::size_t best = bin * columns + std::size_t(std::max_element(row, row + columns) - row);
    return {double(bin) * bin_rad,
            double(best % columns) - half_ + cosine_[bin] * middle_.x() + sine_[bin] * middle_.y(),
            votes_[best]};
  }

 private:
  Eigen::Vector2d middle_;
  int half_;
  std::vector<float> votes_;
  std::array<bool, angle_bins> changed_{};
  std::array<float, angle_bins> highest_{};  // of a direction
  std::vector<double> cosine_, sine_;
};

// Which points lie on a line and point its way.
class Membership {
 public:
  Membership(const EdgeLine& line, double across_px)
      : nx_(static_cast<float>(line.normal().x())),
        ny_(static_cast<float>(line.normal().y())),
        offset_(static_cast<float>(line.offset_px)),
        across_(static_cast<float>(across_px)) {}

  bool operator()(const SlopePoint& p) const {
    return std::abs(nx_ * p.x + ny_ * p.y - offset_) < across_ && nx_ * p.nx + ny_ * p.ny > member_cosine;
  }

 private:
  float nx_, ny_, offset_, across_;
};

// Least squares across the line, weighted by slope. False: too few points.
bool refine(const std::vector<SlopePoint>& points, double across_px, EdgeLine& line) {
  double n = 0, count = 0, t = 0, e = 0, tt = 0, te = 0;
  const Eigen::Vector2d normal = line.normal(), along = line.along();
  const Membership belongs(line, across_px);
  for (const SlopePoint& p : points) {
    if (!belongs(p)) continue;
    const Eigen::Vector2d x(p.x, p.y);
    const double w = p.slope, a = along.dot(x), b = normal.dot(x) - line.offset_px;
    count += 1, n += w, t += w * a, e += w * b, tt += w * a * a, te += w * a * b;
  }
  const double spread = tt - t * t / std::max(n, 1e-9);
  if (count < least_points || !(spread > 0)) return false;
  const double turn = (te - t * e / n) / spread;
  const Eigen::Vector2d on = (t / n) * along + (line.offset_px + e / n) * normal;
  line.normal_rad = wrapped_rad(line.normal_rad - std::atan(turn));
  line.offset_px = line.normal().dot(on);
  return true;
}

struct Profile {
  double first_t = 0;
  std::vector<double> contrast;  // step by step of 1 px; NaN where the sides are not in the window
};

Profile profile_of(const GreyWindow& window, const EdgeLine& line) {
  const double reach = 0.5 * std::hypot(window.width(), window.height());
  const Eigen::Vector2d along = line.along(), foot = line.point(0);
  const double middle = along.dot(Eigen::Vector2d(window.width(), window.height()) / 2);
  Profile profile{std::floor(middle - reach), {}};
  const Eigen::Vector2d side = side_px * line.normal();
  for (double t = profile.first_t; t < middle + reach; t += 1) {
    const Eigen::Vector2d on = foot + t * along;
    const bool in = holds(window, on + side, 0) && holds(window, on - side, 0);
    profile.contrast.push_back(in ? grey_between(window, on + side) - grey_between(window, on - side) : NAN);
  }
  return profile;
}

// Median contrast where points of the edge are.
double contrast_of(const Profile& profile, const std::vector<SlopePoint>& points, const EdgeLine& line) {
  std::vector<double> values;
  const Membership belongs(line, member_px);
  const Eigen::Vector2d along = line.along();
  for (const SlopePoint& p : points) {
    if (!belongs(p)) continue;
    const double t = along.dot(Eigen::Vector2d(p.x, p.y)) - profile.first_t;
    const double value =
        profile.contrast[std::size_t(std::clamp(t, 0.0, double(profile.contrast.size() - 1)))];
    if (std::isfinite(value)) values.push_back(value);
  }
  if (double(values.size()) < least_points) return 0;
  std::nth_element(values.begin(), values.begin() + std::ptrdiff_t(values.size() / 2), values.end());
  return values[values.size() / 2];
}

bool covers(const EdgeLine& line, const Eigen::Vector2d& at) {
  const double t = line.along().dot(at);
  return t > line.t0 - piece_gap_px && t < line.t1 + piece_gap_px;
}

// Fills in what is seen of the line beside the pieces that are known; false: nothing of it.
bool measure_extent(const GreyWindow& window, const std::vector<SlopePoint>& points,
                    const std::vector<EdgeLine>& known, EdgeLine& line) {
  const Profile profile = profile_of(window, line);
  line.contrast = contrast_of(profile, points, line);
  if (!(line.contrast > 0)) return false;
  std::vector<bool> seen;
  for (const double c : profile.contrast) {
    const Eigen::Vector2d at = line.point(profile.first_t + double(seen.size()));
    const bool taken = std::any_of(known.begin(), known.end(), [&](const EdgeLine& other) {
      return std::abs(other.normal().dot(at) - other.offset_px) < member_px &&
             other.normal().dot(line.normal()) > member_cosine && covers(other, at);
    });
    seen.push_back(c > 0.5 * line.contrast && c < 2 * line.contrast && !taken);
  }
  const SeenRun run = longest_run(seen);
  if (run.last < run.first) return false;
  line.t0 = profile.first_t + run.first;
  line.t1 = profile.first_t + run.last;
  const auto outside = [&profile](int k) {
    return k < 0 || k >= int(profile.contrast.size()) || std::isnan(profile.contrast[std::size_t(k)]);
  };
  line.open0 = outside(run.first - 2);
  line.open1 = outside(run.last + 2);
  return true;
}

bool wanted(const EdgeLine& line, const LineLimits& limits) {
  return limits.tolerance_rad > largest_tolerance_rad ||
         std::abs(wrapped_rad(line.normal_rad - limits.direction_rad)) <= limits.tolerance_rad;
}

}  // namespace

double wrapped_rad(double angle_rad) { return std::remainder(angle_rad, 2 * pi); }

bool holds(const GreyWindow& window, const Eigen::Vector2d& at, double margin_px) {
  return at.x() >= margin_px && at.y() >= margin_px && at.x() <= window.width() - 1 - margin_px &&
         at.y() <= window.height() - 1 - margin_px;
}

double grey_between(const GreyWindow& window, const Eigen::Vector2d& at) {
  const int i = std::clamp(static_cast<int>(at.x()), 0, window.width() - 2);
  const int j = std::clamp(static_cast<int>(at.y()), 0, window.height() - 2);
  const double fx = at.x() - i, fy = at.y() - j;
  return (1 - fy) * ((1 - fx) * window.at(i, j) + fx * window.at(i + 1, j)) +
         fy * ((1 - fx) * window.at(i, j + 1) + fx * window.at(i + 1, j + 1));
}

SeenRun longest_run(const std::vector<bool>& seen) {
  SeenRun best;
  int sum = 0, highest = 0, first = 0;
  for (int k = 0; k < int(seen.size()); ++k) {
    sum += seen[std::size_t(k)] ? 1 : -2;
    if (sum <= 0) {
      sum = 0;
      first = k + 1;
    } else if (sum > highest) {
      highest = sum;
      best = {first, k};
    }
  }
  return best;
}

std::vector<EdgeLine> find_lines(const GreyWindow& window, const LineLimits& limits) {
  const double widest = std::hypot(limits.max_blur_px, 1.2);
  const double least_slope = 0.35 * limits.min_contrast / (std::sqrt(2 * pi) * widest);
  std::vector<SlopePoint> points = find_edge_points(window, least_slope), left;
  VoteTable table(window);
  for (const SlopePoint& p : points) {
    if (limits.tolerance_rad > largest_tolerance_rad ||
        std::abs(wrapped_rad(std::atan2(p.ny, p.nx) - limits.direction_rad)) <=
            limits.tolerance_rad + member_rad) {
      table.add(p, p.slope);
      left.push_back(p);
    }
  }
  std::vector<EdgeLine> lines;
  const std::vector<EdgeLine> none;
  for (std::size_t k = 0; k < 3 * limits.most && lines.size() < limits.most; ++k) {
    const VoteTable::Peak peak = table.highest();
    if (peak.votes < least_points * least_slope) break;
    EdgeLine line;
    line.normal_rad = wrapped_rad(peak.normal_rad);
    line.offset_px = peak.offset_px;
    const EdgeLine before = line;
    const bool refined = refine(left, member_px, line) && refine(left, 1.5, line) && refine(left, 1.5, line);
    const bool good = refined && wanted(line, limits) &&
                      measure_extent(window, left, limits.all_pieces ? lines : none, line) &&
                      line.length() >= limits.min_length_px;
    if (good) lines.push_back(line);
    const Membership on_line(line, member_px), on_peak(before, 1);
    const bool leave_others = good && limits.all_pieces;
    const auto taken = std::stable_partition(left.begin(), left.end(), [&](const SlopePoint& p) {
      return (!on_line(p) && !on_peak(p)) || (leave_others && !covers(line, Eigen::Vector2d(p.x, p.y)));
    });
    if (taken == left.end()) break;
    std::for_each(taken, left.end(), [&table](const SlopePoint& p) { table.add(p, -p.slope); });
    left.erase(taken, left.end());
  }
  return lines;
}

}  // namespace zeropose
