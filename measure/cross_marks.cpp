// The cross.
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <optional>

#include "measure/edge_mark_judge.h"
#include "measure/edge_marks.h"

namespace zeropose {
namespace {

constexpr double pi = std::numbers::pi;
constexpr double narrowest_px = 2.5;
constexpr double parallel_rad = 0.1;
constexpr double end_px = 3;             // left out where an arm ends in the window
constexpr double least_arm_px = 6;       // from the other bar's edge
constexpr int widest_dirt_px = 8;        // on an arm; what is seen behind a wider gap is another one's
constexpr std::size_t most_lines = 20;   // four of them the cross's
constexpr std::size_t most_crosses = 6;  // fits per window where one is wanted

// Two edges back to back.
struct CrossBar {
  double direction_rad = 0;
  double offset_px = 0;  // of the middle line, along (-sin, cos) of the direction
  double half_px = 0;    // of its width
  double contrast = 0;

  Eigen::Vector2d along() const { return {std::cos(direction_rad), std::sin(direction_rad)}; }
  Eigen::Vector2d across() const { return {-std::sin(direction_rad), std::cos(direction_rad)}; }
};

struct CrossStart {
  CrossBar first, second;
  Eigen::Vector2d centre = Eigen::Vector2d::Zero();
  std::array<double, 4> arms_px{};  // as CrossShape has them
  bool cut = false;                 // an arm reaches to the window's border
  double contrast() const { return std::min(first.contrast, second.contrast); }
  double span() const { return std::max(arms_px[0] + arms_px[1], arms_px[2] + arms_px[3]); }
};

std::optional<CrossBar> bar_of(const EdgeLine& one, const EdgeLine& other, const MarkSearch& search) {
  if (std::abs(wrapped_rad(one.normal_rad - other.normal_rad + pi)) > parallel_rad) return std::nullopt;
  const double turn = wrapped_rad(other.normal_rad + pi - one.normal_rad);
  const double normal_rad = one.normal_rad + 0.5 * turn;
  const Eigen::Vector2d normal(std::cos(normal_rad), std::sin(normal_rad));
  const double middle_t = 0.25 * (one.t0 + one.t1 - other.t0 - other.t1);
  const double a = normal.dot(one.point(middle_t)), b = normal.dot(other.point(-middle_t));
  const double width = search.bright ? b - a : a - b;  // the normal points from dark to bright
  if (width < narrowest_px || width > 0.5 * search.max_diameter_px) return std::nullopt;
  const double ratio = one.contrast / other.contrast;
  if (ratio < 0.5 || ratio > 2) return std::nullopt;
  return CrossBar{wrapped_rad(normal_rad - pi / 2), 0.5 * (a + b), 0.5 * width,
                  std::min(one.contrast, other.contrast)};
}

bool right_bars(double first_rad, double second_rad, const MarkSearch& search, double room_rad) {
  const double opening = std::abs(wrapped_line_rad(second_rad - first_rad));
  const double asked = std::abs(wrapped_line_rad(search.opening_rad));
  const double turn = std::min(std::abs(wrapped_line_rad(first_rad - search.direction_rad)),
                               std::abs(wrapped_line_rad(second_rad - search.direction_rad)));
  return std::abs(opening - asked) <= search.opening_tolerance_rad + room_rad &&
         turn <= search.direction_tolerance_rad + room_rad;
}

// Where an arm is seen: the middle darker (bright: brighter) than both sides, by steps of 1 px from the
// centre.
double arm_length(const GreyWindow& window, const CrossStart& cross, const CrossBar& bar, double sense,
                  bool bright, bool& cut) {
  const double sign = bright ? -1 : 1, first = bar.half_px + 3;
  const Eigen::Vector2d side = (bar.half_px + 2.5) * bar.across();
  std::vector<bool> seen;
  int unseen = 0;
  double t = first;
  for (;; t += 1) {
    const Eigen::Vector2d on = cross.centre + sense * t * bar.along();
    if (!holds(window, on + side, 0) || !holds(window, on - side, 0)) break;
    const double middle = grey_between(window, on);
    const double less = std::min(sign * (grey_between(window, on + side) - middle),
                                 sign * (grey_between(window, on - side) - middle));
    seen.push_back(less > 0.4 * cross.contrast());
    unseen = seen.back() ? 0 : unseen + 1;
    if (unseen > widest_dirt_px && int(seen.size()) > 2 * unseen) break;
  }
  const SeenRun run = longest_run(seen);
  const bool open = run.last + 2 >= int(seen.size());
  cut = cut || open;
  if (run.last < run.first || run.first > 4) return 0;
  return first + run.last - (open ? 0 : end_px);
}

std::optional<CrossStart> cross_of(const GreyWindow& window, const CrossBar& one, const CrossBar& other,
                                   const MarkSearch& search) {
  if (!right_bars(one.direction_rad, other.direction_rad, search, 0.1) ||
      std::abs(one.half_px - other.half_px) > 0.5 + 0.15 * std::max(one.half_px, other.half_px)) {
    return std::nullopt;
  }
  CrossStart cross{one, other};
  const Eigen::Vector2d a = one.across(), b = other.across();
  const double determinant = a.x() * b.y() - a.y() * b.x();
  if (std::abs(determinant) < 0.3) return std::nullopt;
  cross.centre = Eigen::Vector2d(b.y() * one.offset_px - a.y() * other.offset_px,
                                 a.x() * other.offset_px - b.x() * one.offset_px) /
                 determinant;
  if (!holds(window, cross.centre, 0)) return std::nullopt;
  const double least = one.half_px / std::abs(determinant) + least_arm_px;
  for (std::size_t k = 0; k < 4; ++k) {
    cross.arms_px[k] =
        arm_length(window, cross, k < 2 ? one : other, k % 2 == 0 ? 1 : -1, search.bright, cross.cut);
    if (cross.arms_px[k] < least) return std::nullopt;
  }
  return cross;
}

std::vector<CrossStart> crosses_of(const GreyWindow& window, const MarkSearch& search, HowMany wanted) {
  const std::vector<EdgeLine> lines = find_lines(window, line_limits_of(search, wanted, most_lines));
  std::vector<CrossBar> bars;
  for (std::size_t i = 0; i < lines.size(); ++i) {
    for (std::size_t j = i + 1; j < lines.size(); ++j) {
      if (const auto bar = bar_of(lines[i], lines[j], search)) bars.push_back(*bar);
    }
  }
  std::vector<CrossStart> crosses;
  for (std::size_t i = 0; i < bars.size(); ++i) {
    for (std::size_t j = i + 1; j < bars.size(); ++j) {
      if (const auto cross = cross_of(window, bars[i], bars[j], search)) crosses.push_back(*cross);
    }
  }
  std::stable_sort(crosses.begin(), crosses.end(), [](const CrossStart& a, const CrossStart& b) {
    return a.contrast() * a.span() > b.contrast() * b.span();
  });
  crosses.resize(std::min(wanted.one() ? most_crosses : wanted.most, crosses.size()));
  return crosses;
}

double nearer_direction(double first_rad, double second_rad, double asked_rad) {
  const double first = wrapped_line_rad(first_rad - asked_rad),
               second = wrapped_line_rad(second_rad - asked_rad);
  return wrapped_rad(asked_rad + (std::abs(first) <= std::abs(second) ? first : second));
}

MarkStatus size_status(const MarkFinding& finding, const MarkSearch& search) {
  if (finding.diameter_px < search.min_diameter_px) return MarkStatus::too_small;
  return finding.diameter_px > search.max_diameter_px ? MarkStatus::no_candidate : MarkStatus::found;
}

JudgedMark judged_cross(const GreyWindow& window, const MarkSearch& search, const CrossStart& cross,
                        ContourWorkspace& workspace) {
  ContourStart start;
  start.origin_i = static_cast<int>(std::lround(cross.centre.x()));
  start.origin_j = static_cast<int>(std::lround(cross.centre.y()));
  const Eigen::Vector2d origin(start.origin_i, start.origin_j);
  start.shape.head<2>() = cross.centre - origin;
  start.shape(2) = cross.first.direction_rad;
  start.shape(3) = cross.second.direction_rad;
  start.shape(4) = 0.5 * (cross.first.half_px + cross.second.half_px);
  const ContourFit fit = fit_contour(window, CrossShape(cross.arms_px), start, workspace);
  JudgedMark mark{judged_fit(fit, search), cross.contrast() * cross.span()};
  MarkFinding& finding = mark.finding;
  finding.u_px = to_image(window, origin + fit.shape.head<2>());
  finding.covariance_px2 = fit.covariance.topLeftCorner<2, 2>();
  finding.direction_rad = nearer_direction(fit.shape(2), fit.shape(3), search.direction_rad);
  finding.diameter_px = cross.span() + (cross.cut ? 0 : 2 * end_px);
  finding.axis_ratio = 2 * fit.shape(4) / finding.diameter_px;
  if (finding.status != MarkStatus::found) return mark;
  if ((fit.mark_grey > fit.background_grey) != search.bright) {
    finding.status = MarkStatus::not_converged;
  } else if (!right_bars(fit.shape(2), fit.shape(3), search, 0)) {
    finding.status = MarkStatus::no_candidate;
  } else {
    finding.status = size_status(finding, search);
  }
  return mark;
}

}  // namespace

MarkSight look_for_crosses(const ImageView& image, const MarkSearch& search, HowMany wanted) {
  const OpenedWindow opened = open_window(image, search, true);
  if (opened.status != MarkStatus::found) return sight_without(opened.status);
  std::vector<JudgedMark> marks;
  ContourWorkspace workspace;
  for (const CrossStart& cross : crosses_of(opened.greys, search, wanted)) {
    marks.push_back(judged_cross(opened.greys, search, cross, workspace));
  }
  return sight_of(marks, opened.greys, search, wanted);
}

}  // namespace zeropose
