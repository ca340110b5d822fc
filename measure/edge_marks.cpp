// The edge and the corner.
#include "measure/edge_marks.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "measure/edge_mark_judge.h"

namespace zeropose {
namespace {

constexpr double pi = std::numbers::pi;
constexpr double end_px = 3;  // left out where an edge ends in the window
constexpr double piece_px = 2,
                 piece_rad = 0.1;  // how far pieces of one line may be apart where it is asked for
constexpr double meeting_px = 7;   // an arm is seen from that near to the corner on
constexpr double beyond_px = 6;    // and not further behind it
constexpr std::size_t most_corners = 8, most_edges = 8;  // fits per window where one is wanted

double least_length(const MarkSearch& search) { return std::max(edge_least_px, search.min_diameter_px); }

int nearest(double x) { return static_cast<int>(std::lround(x)); }

// ---- edge

struct EdgeRun {
  double from, to;  // along the line
};

EdgeRun run_of(const EdgeLine& line) {
  return {line.t0 + (line.open0 ? 0 : end_px), line.t1 - (line.open1 ? 0 : end_px)};
}

// How much of the run has its whole band in the window.
bool band_in_window(const GreyWindow& window, const EdgeLine& line, double blur_px) {
  const EdgeRun run = run_of(line);
  const Eigen::Vector2d side = (0.5 + contour_core_px(blur_px)) * line.normal();
  int in = 0, all = 0;
  for (double t = run.from; t <= run.to; t += 1, ++all) {
    in += holds(window, line.point(t) + side, 0) && holds(window, line.point(t) - side, 0) ? 1 : 0;
  }
  return in >= contour_least_share * all;
}

// Of the offset along the normal at t, and of the normal's direction.
Eigen::Matrix2d covariance_of_line(const ContourFit& fit, double t) {
  const Eigen::Matrix2d J{{1, -t}, {0, 1}};
  return J * fit.covariance.topLeftCorner<2, 2>() * J.transpose();
}

// Across as given, along as good as unknown.
Eigen::Matrix2d covariance_of_edge(double across_px2, const Eigen::Vector2d& normal) {
  const Eigen::Vector2d along(-normal.y(), normal.x());
  return across_px2 * normal * normal.transpose() + unknown_along_px2 * along * along.transpose();
}

JudgedMark fit_edge(const GreyWindow& window, const MarkSearch& search, const EdgeLine& line,
                    ContourWorkspace& workspace) {
  const EdgeRun run = run_of(line);
  const Eigen::Vector2d middle = line.point(0.5 * (run.from + run.to));
  ContourStart start;
  start.origin_i = nearest(middle.x());
  start.origin_j = nearest(middle.y());
  const Eigen::Vector2d origin(start.origin_i, start.origin_j);
  start.shape(0) = line.offset_px - line.normal().dot(origin);
  start.shape(1) = line.normal_rad;
  const double t_origin = line.along().dot(origin);
  const EdgeShape shape(run.from - t_origin, run.to - t_origin);
  const ContourFit fit = fit_contour(window, shape, start, workspace);
  JudgedMark mark{judged_fit(fit, search), 0};
  mark.middle_px = to_image(window, middle);
  mark.finding.diameter_px = line.length();
  mark.strength = mark.finding.contrast * line.length();
  if (!fit.converged) mark.finding.contrast = line.contrast;
  const ShapeParameters& at = fit.converged ? fit.shape : start.shape;
  const double angle = at(1);
  const Eigen::Vector2d normal(std::cos(angle), std::sin(angle)), along(-normal.y(), normal.x());
  const Eigen::Vector2d expected = to_window(window, search.expected_px) - origin;
  const double t = along.dot(expected);
  mark.finding.u_px = to_image(window, origin + at(0) * normal + t * along);
  mark.finding.direction_rad = wrapped_rad(angle);
  mark.line_covariance = covariance_of_line(fit, t);
  mark.finding.covariance_px2 = covariance_of_edge(mark.line_covariance(0, 0), normal);
  if (mark.finding.status == MarkStatus::found && fit.background_grey < fit.mark_grey) {
    mark.finding.status = MarkStatus::not_converged;
  }
  return mark;
}

bool right_direction(double direction_rad, const MarkSearch& search) {
  return search.direction_tolerance_rad >= pi ||
         std::abs(wrapped_rad(direction_rad - search.direction_rad)) <= search.direction_tolerance_rad;
}

JudgedMark judged_edge(const GreyWindow& window, const MarkSearch& search, const EdgeLine& line,
                       ContourWorkspace& workspace) {
  JudgedMark mark = fit_edge(window, search, line, workspace);
  MarkStatus& status = mark.finding.status;
  if (status == MarkStatus::found && !right_direction(mark.finding.direction_rad, search)) {
    status = MarkStatus::no_candidate;
  } else if (line.length() < least_length(search)) {
    status = line.open0 || line.open1 ? MarkStatus::cut_off : MarkStatus::too_small;
  } else if (!band_in_window(window, line, std::max(0.5, mark.finding.blur_px))) {
    status = MarkStatus::cut_off;
  }
  return mark;
}

std::vector<JudgedMark> judged_edges(const GreyWindow& window, const MarkSearch& search, HowMany wanted) {
  LineLimits limits = line_limits_of(search, wanted, most_edges);
  limits.direction_rad = search.direction_rad;
  limits.tolerance_rad = search.direction_tolerance_rad + 0.05;
  std::vector<JudgedMark> marks;
  ContourWorkspace workspace;
  for (const EdgeLine& line : find_lines(window, limits))
    marks.push_back(judged_edge(window, search, line, workspace));
  return marks;
}

EdgeFinding with_line(const JudgedMark& mark, const std::vector<JudgedMark>& all) {
  EdgeFinding edge{mark.finding, mark.middle_px, 0, mark.line_covariance};
  for (const JudgedMark& other : all) {
    const double turn = wrapped_rad(other.finding.direction_rad - mark.finding.direction_rad);
    const bool piece =
        (other.finding.u_px - mark.finding.u_px).norm() < piece_px && std::abs(turn) < piece_rad;
    edge.strength += piece ? other.finding.contrast * other.finding.diameter_px : 0;
  }
  return edge;
}

// ---- corner

// An angle filled by the mark: arms away from the corner, the mark from the first to the second.
struct CornerStart {
  Eigen::Vector2d tip = Eigen::Vector2d::Zero();
  double first_rad = 0, second_rad = 0;
  double first_px = 0, second_px = 0;  // lengths that are seen
  double contrast = 0;
};

// What the search asks for an angle below pi: a mark that fills more is a background that fills less.
MarkSearch convex(const MarkSearch& search) {
  MarkSearch out = search;
  if (search.opening_rad > pi) {
    out.bright = !search.bright;
    out.direction_rad = wrapped_rad(search.direction_rad + pi);
    out.opening_rad = 2 * pi - search.opening_rad;
  }
  return out;
}

bool right_angle(double first_rad, double second_rad, const MarkSearch& search, double room_rad) {
  const double opening = wrapped_rad(second_rad - first_rad);
  const double turn = wrapped_rad(first_rad + 0.5 * opening - search.direction_rad);
  return opening > 0 && std::abs(opening - search.opening_rad) <= search.opening_tolerance_rad + room_rad &&
         (search.direction_tolerance_rad >= pi ||
          std::abs(turn) <= search.direction_tolerance_rad + room_rad);
}

// How far the line is seen from the corner along a direction; 0 if not from there on, or also behind it.
double arm_length(const EdgeLine& line, const Eigen::Vector2d& tip, double direction_rad) {
  const Eigen::Vector2d arm(std::cos(direction_rad), std::sin(direction_rad));
  const double sense = line.along().dot(arm) > 0 ? 1 : -1, at = line.along().dot(tip);
  const double near = sense > 0 ? line.t0 - at : at - line.t1, far = sense > 0 ? line.t1 - at : at - line.t0;
  const bool open = sense > 0 ? line.open1 : line.open0;
  if (near > meeting_px || near < -beyond_px) return 0;
  return far - (open ? 0 : end_px);
}

// An edge of either sense on the arm's line behind the corner.
bool goes_on(const GreyWindow& window, const Eigen::Vector2d& tip, double direction_rad, double contrast) {
  const Eigen::Vector2d arm(std::cos(direction_rad), std::sin(direction_rad)), side(-arm.y(), arm.x());
  double sum = 0;
  int count = 0;
  for (double t = 5; t <= 9; t += 1, ++count) {
    const Eigen::Vector2d a = tip - t * arm + 2.5 * side, b = tip - t * arm - 2.5 * side;
    if (!holds(window, a, 0) || !holds(window, b, 0)) break;
    sum += grey_between(window, a) - grey_between(window, b);
  }
  return count > 1 && std::abs(sum) > 0.5 * contrast * count;
}

std::optional<CornerStart> corner_of(const EdgeLine& one, const EdgeLine& other, const MarkSearch& search,
                                     const GreyWindow& window) {
  const double flip = search.bright ? pi : 0;
  CornerStart corner;
  corner.first_rad = wrapped_rad(one.normal_rad + flip + pi / 2);
  corner.second_rad = wrapped_rad(other.normal_rad + flip - pi / 2);
  if (!right_angle(corner.first_rad, corner.second_rad, search, 0.1)) return std::nullopt;
  const Eigen::Vector2d a = one.normal(), b = other.normal();
  const double determinant = a.x() * b.y() - a.y() * b.x();
  if (std::abs(determinant) < 0.1) return std::nullopt;
  corner.tip = Eigen::Vector2d(b.y() * one.offset_px - a.y() * other.offset_px,
                               a.x() * other.offset_px - b.x() * one.offset_px) /
               determinant;
  if (!holds(window, corner.tip, 3)) return std::nullopt;
  corner.first_px = arm_length(one, corner.tip, corner.first_rad);
  corner.second_px = arm_length(other, corner.tip, corner.second_rad);
  corner.contrast = std::min(one.contrast, other.contrast);
  if (!(std::min(corner.first_px, corner.second_px) > 4) ||
      goes_on(window, corner.tip, corner.first_rad, corner.contrast) ||
      goes_on(window, corner.tip, corner.second_rad, corner.contrast)) {
    return std::nullopt;
  }
  return corner;
}

std::vector<CornerStart> corners_of(const std::vector<EdgeLine>& lines, const MarkSearch& search,
                                    const GreyWindow& window, HowMany wanted) {
  std::vector<CornerStart> corners;
  for (std::size_t i = 0; i < lines.size(); ++i) {
    for (std::size_t j = 0; j < lines.size(); ++j) {
      if (i == j) continue;
      if (const auto corner = corner_of(lines[i], lines[j], search, window)) corners.push_back(*corner);
    }
  }
  const auto strength = [](const CornerStart& c) { return c.contrast * (c.first_px + c.second_px); };
  std::stable_sort(corners.begin(), corners.end(), [&strength](const CornerStart& a, const CornerStart& b) {
    return strength(a) > strength(b);
  });
  corners.resize(std::min(wanted.one() ? most_corners : wanted.most, corners.size()));
  return corners;
}

JudgedMark judged_corner(const GreyWindow& window, const MarkSearch& search, const CornerStart& corner,
                         ContourWorkspace& workspace) {
  ContourStart start;
  start.origin_i = nearest(corner.tip.x());
  start.origin_j = nearest(corner.tip.y());
  const Eigen::Vector2d origin(start.origin_i, start.origin_j);
  start.shape.head<2>() = corner.tip - origin;
  start.shape(2) = corner.first_rad;
  start.shape(3) = corner.first_rad + wrapped_rad(corner.second_rad - corner.first_rad);
  const ContourFit fit =
      fit_contour(window, CornerShape(corner.first_px, corner.second_px), start, workspace);
  JudgedMark mark{judged_fit(fit, search), corner.contrast * (corner.first_px + corner.second_px)};
  MarkFinding& finding = mark.finding;
  const Eigen::Vector2d tip = origin + fit.shape.head<2>();
  finding.u_px = to_image(window, tip);
  finding.covariance_px2 = fit.covariance.topLeftCorner<2, 2>();
  finding.direction_rad = wrapped_rad(0.5 * (fit.shape(2) + fit.shape(3)));
  finding.diameter_px = std::max(corner.first_px, corner.second_px);
  finding.axis_ratio = std::min(corner.first_px, corner.second_px) / finding.diameter_px;
  if (finding.status != MarkStatus::found) return mark;
  if ((fit.mark_grey > fit.background_grey) != search.bright) {
    finding.status = MarkStatus::not_converged;
  } else if (!right_angle(fit.shape(2), fit.shape(3), search, 0)) {
    finding.status = MarkStatus::no_candidate;
  } else if (!holds(window, tip, contour_core_px(fit.blur_px))) {
    finding.status = MarkStatus::cut_off;
  } else if (std::min(corner.first_px, corner.second_px) < least_length(search)) {
    finding.status = MarkStatus::too_small;
  }
  return mark;
}

}  // namespace

MarkSight look_for_edges(const ImageView& image, const MarkSearch& search, HowMany wanted) {
  const OpenedWindow opened = open_window(image, search, false);
  if (opened.status != MarkStatus::found) return sight_without(opened.status);
  return sight_of(judged_edges(opened.greys, search, wanted), opened.greys, search, wanted);
}

EdgeSight look_for_edge_lines(const ImageView& image, const MarkSearch& search, HowMany wanted) {
  const OpenedWindow opened = open_window(image, search, false);
  if (opened.status != MarkStatus::found) return {{}, {}, sight_without(opened.status).nearest};
  const std::vector<JudgedMark> marks = judged_edges(opened.greys, search, wanted);
  const MarkSight sight = sight_of(marks, opened.greys, search, wanted);
  EdgeSight lines{{}, {}, sight.nearest};
  for (const JudgedMark& mark : marks)
    if (!stands(mark.finding)) lines.failed.push_back(with_line(mark, marks));
  for (const MarkFinding& mark : sight.standing) {
    const auto judged = std::find_if(marks.begin(), marks.end(), [&mark](const JudgedMark& other) {
      return other.finding.u_px == mark.u_px && other.finding.direction_rad == mark.direction_rad;
    });
    if (judged != marks.end()) lines.standing.push_back(with_line(*judged, marks));
  }
  return lines;
}

MarkSight look_for_corners(const ImageView& image, const MarkSearch& asked, HowMany wanted) {
  const OpenedWindow opened = open_window(image, asked, false);
  if (opened.status != MarkStatus::found) return sight_without(opened.status);
  const MarkSearch search = convex(asked);
  const std::vector<EdgeLine> lines =
      find_lines(opened.greys, line_limits_of(search, wanted, LineLimits{}.most));
  std::vector<JudgedMark> marks;
  ContourWorkspace workspace;
  for (const CornerStart& corner : corners_of(lines, search, opened.greys, wanted)) {
    marks.push_back(judged_corner(opened.greys, search, corner, workspace));
  }
  MarkSight sight = sight_of(marks, opened.greys, search, wanted);
  if (asked.opening_rad <= pi) return sight;
  sight.nearest.direction_rad = wrapped_rad(sight.nearest.direction_rad + pi);
  for (MarkFinding& mark : sight.standing) mark.direction_rad = wrapped_rad(mark.direction_rad + pi);
  return sight;
}

}  // namespace zeropose
