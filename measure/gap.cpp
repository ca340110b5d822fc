#include "measure/gap.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <optional>
#include <vector>

#include "calib/words.h"
#include "measure/edge_marks.h"

namespace zeropose {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr std::size_t most_edges = 24;  // of either sense that are looked at
constexpr double same_edge_px = 3;
constexpr double rival_strength = 0.5;             // of the best pair's: then it is a rival
constexpr double least_quality = 0.7;              // of either edge
constexpr double least_sine = 0.1;                 // between the plane and the line of sight
constexpr double step_px = 1e-3, step_rad = 1e-5;  // for derivatives

Vector2d unit(double angle_rad) { return {std::cos(angle_rad), std::sin(angle_rad)}; }
double cross(const Vector2d& a, const Vector2d& b) { return a.x() * b.y() - a.y() * b.x(); }
std::string degrees(double rad, int decimals = 2) {
  return number(rad * degrees_per_radian, decimals) + " deg";
}

// Pixels to places on the plane, mm along two of its directions.
class PlaneView {
 public:
  PlaneView(const CalibratedCamera& camera, const GapPlane& plane) : model_(camera.model) {
    const Pose X_CH = camera.X_WC.inverse();
    n_C_ = X_CH.linear() * plane.n_H.normalized();
    origin_C_ = n_C_ * n_C_.dot(X_CH * plane.p_H_mm);  // the point next to the camera
    if (n_C_.z() < 0) n_C_ = -n_C_;                    // so that the axes turn like those of the image
    x_C_ = (Vector3d::UnitX() - n_C_.x() * n_C_);
    if (std::abs(n_C_.x()) > 0.9) x_C_ = Vector3d::UnitY() - n_C_.y() * n_C_;
    x_C_.normalize();
    y_C_ = n_C_.cross(x_C_);
  }

  // Nothing where the plane is not seen.
  std::optional<Vector2d> place(const Vector2d& u_px) const {
    const auto d = ray(model_, u_px);
    if (!d || !(std::abs(n_C_.dot(d->normalized())) >= least_sine)) return std::nullopt;
    const double depth = n_C_.dot(origin_C_) / n_C_.dot(*d);
    if (!(depth > 0)) return std::nullopt;
    const Vector3d off = depth * *d - origin_C_;
    return Vector2d(x_C_.dot(off), y_C_.dot(off));
  }
  Vector3d point_C(const Vector2d& at) const { return origin_C_ + direction_C(at); }
  Vector3d direction_C(const Vector2d& v) const { return v.x() * x_C_ + v.y() * y_C_; }

 private:
  const CameraModel& model_;
  Vector3d n_C_, origin_C_, x_C_, y_C_;
};

// ---- the gap between two lines

struct ImageLine {
  Vector2d u_px;
  double normal_rad;
  Vector2d middle_px;  // of what is seen of it, about on the line
  double length_px;
};

// Moved across by px and turned about u_px by rad.
ImageLine changed(ImageLine line, double across_px, double turn_rad) {
  line.u_px += across_px * unit(line.normal_rad);
  line.normal_rad += turn_rad;
  return line;
}

struct PlaneLine {
  Vector2d at, along;
};

// The lens bends the edge; a straight line fitted to a shallow bow meets it at 1 / sqrt(12) of its length to
// either side of the middle. search_rad: the lines of both edges point the same way about it.
std::optional<PlaneLine> on_plane(const PlaneView& view, const ImageLine& line, double search_rad) {
  Vector2d along = unit(line.normal_rad + std::numbers::pi / 2);
  if (cross(unit(search_rad), along) < 0) along = -along;
  const Vector2d middle = line.u_px + along.dot(line.middle_px - line.u_px) * along;
  const double off_px = line.length_px / std::sqrt(12.0);
  const auto from = view.place(middle - off_px * along), to = view.place(middle + off_px * along);
  if (!from || !to) return std::nullopt;
  return PlaneLine{*from, (*to - *from).normalized()};
}

struct PlaneGap {
  double gap_mm = 0, wedge_rad = 0;
  PlaneLine frame, pane;  // at: where the gap is measured
  Vector2d across;        // unit vector from the frame to the pane
};

// Where the line crosses the one through the centre along `across`: the distance from the centre.
double crossing(const PlaneLine& line, const Vector2d& centre, const Vector2d& across) {
  return cross(line.at - centre, line.along) / cross(across, line.along);
}

std::optional<PlaneGap> gap_between(const PlaneView& view, const GapSearch& search, const ImageLine& frame,
                                    const ImageLine& pane) {
  const auto centre = view.place(search.centre_px);
  const auto f = on_plane(view, frame, search.direction_rad), p = on_plane(view, pane, search.direction_rad);
  if (!centre || !f || !p) return std::nullopt;
  PlaneGap gap{0, 0, *f, *p, {}};
  const Vector2d along = (f->along + p->along).normalized();
  gap.across = {along.y(), -along.x()};  // the plane's axes turn like those of the image
  const double at_frame = crossing(*f, *centre, gap.across), at_pane = crossing(*p, *centre, gap.across);
  gap.frame.at = *centre + at_frame * gap.across;
  gap.pane.at = *centre + at_pane * gap.across;
  gap.gap_mm = at_pane - at_frame;
  gap.wedge_rad = -std::atan2(cross(f->along, p->along), f->along.dot(p->along));
  return gap;
}

ImageLine line_of(const EdgeFinding& edge) {
  return {edge.mark.u_px, edge.mark.direction_rad, edge.middle_px, edge.mark.diameter_px};
}

// What lies on an edge also disturbs the pieces beside it that are used: measured, not derived.
Eigen::Matrix2d covariance_of(const EdgeFinding& edge) {
  return edge.line_covariance / (edge.mark.outline_share * edge.mark.outline_share);
}

// Of gap and wedge. Nothing where the plane ends to be seen.
std::optional<Eigen::Matrix2d> covariance_of(const PlaneView& view, const GapSearch& search,
                                             const EdgeFinding& frame, const EdgeFinding& pane) {
  Eigen::Matrix2d sum = Eigen::Matrix2d::Zero();
  const ImageLine f = line_of(frame), p = line_of(pane);
  for (const bool of_frame : {true, false}) {
    Eigen::Matrix2d J;
    for (int k = 0; k < 2; ++k) {
      const double px = k == 0 ? step_px : 0, rad = k == 1 ? step_rad : 0;
      const auto more = of_frame ? gap_between(view, search, changed(f, px, rad), p)
                                 : gap_between(view, search, f, changed(p, px, rad));
      const auto less = of_frame ? gap_between(view, search, changed(f, -px, -rad), p)
                                 : gap_between(view, search, f, changed(p, -px, -rad));
      if (!more || !less) return std::nullopt;
      J.col(k) = Vector2d(more->gap_mm - less->gap_mm, more->wedge_rad - less->wedge_rad) / (2 * (px + rad));
    }
    sum += J * covariance_of(of_frame ? frame : pane) * J.transpose();
  }
  return sum;
}

// ---- the pair of edges

MarkSearch search_for(const GapSearch& search, EdgeSense sense) {
  MarkSearch out;
  out.kind = MarkKind::edge;
  out.expected_px = search.centre_px;
  const Vector2d across = unit(search.direction_rad).cwiseAbs();
  out.half_window_px =
      search.half_across_px * across + search.half_along_px * Vector2d(across.y(), across.x());
  out.min_diameter_px = std::max(edge_least_px, 2 * search.half_along_px * search.min_length_share);
  out.max_diameter_px = 2 * out.half_window_px.norm();
  out.min_contrast = search.min_contrast;
  out.max_blur_px = search.max_blur_px;
  out.direction_rad = search.direction_rad + (sense == EdgeSense::dark_to_bright ? 0 : std::numbers::pi);
  out.direction_tolerance_rad = search.direction_tolerance_rad;
  return out;
}

// Pieces of one edge, or the same once more.
bool same_edge(const EdgeFinding& a, const EdgeFinding& b) {
  return (a.mark.u_px - b.mark.u_px).norm() < same_edge_px;
}

// Where the edge crosses the window's axis across the gap, px from its centre.
double place_in_window(const EdgeFinding& edge, const GapSearch& search) {
  const Vector2d n = unit(edge.mark.direction_rad);
  return n.dot(edge.mark.u_px - search.centre_px) / n.dot(unit(search.direction_rad));
}

struct EdgePair {
  GapStatus status = GapStatus::failed;
  const EdgeFinding *frame = nullptr, *pane = nullptr;
  PlaneGap gap;
  double strength = 0;  // of the weaker edge

  // Of two edges that count. One that failed may still be the edge that is meant.
  bool sound() const { return stands(frame->mark) && stands(pane->mark); }
};

GapStatus status_of(const EdgePair& pair, const GapSearch& search) {
  for (const EdgeFinding* edge : {pair.frame, pair.pane})
    if (std::abs(place_in_window(*edge, search)) > search.half_across_px) return GapStatus::outside_window;
  if (pair.gap.gap_mm <= 0) return GapStatus::overlap;
  if (pair.gap.gap_mm < search.min_gap_mm || pair.gap.gap_mm > search.max_gap_mm)
    return GapStatus::out_of_range;
  return std::abs(pair.gap.wedge_rad) > search.max_wedge_rad ? GapStatus::not_parallel : GapStatus::ok;
}

std::vector<const EdgeFinding*> edges_of(const EdgeSight& sight) {
  std::vector<const EdgeFinding*> edges;
  for (const auto* list : {&sight.standing, &sight.failed})
    for (const EdgeFinding& edge : *list) edges.push_back(&edge);
  return edges;
}

// The sound ones first, of these the ones that pass, then by strength.
std::vector<EdgePair> pairs_of(const PlaneView& view, const GapSearch& search, const EdgeSight& frames,
                               const EdgeSight& panes) {
  std::vector<EdgePair> pairs;
  for (const EdgeFinding* frame : edges_of(frames))
    for (const EdgeFinding* pane : edges_of(panes)) {
      if (frame->mark.u_px == pane->mark.u_px) continue;  // both of one sense: the same edge
      const auto gap = gap_between(view, search, line_of(*frame), line_of(*pane));
      if (!gap) continue;
      EdgePair pair{GapStatus::failed, frame, pane, *gap, std::min(frame->strength, pane->strength)};
      pair.status = status_of(pair, search);
      pairs.push_back(pair);
    }
  const auto rank = [](const EdgePair& pair) {
    return pair.sound() ? (pair.status == GapStatus::ok ? 0 : 1) : 2;
  };
  std::stable_sort(pairs.begin(), pairs.end(), [&rank](const EdgePair& a, const EdgePair& b) {
    return rank(a) != rank(b) ? rank(a) < rank(b) : a.strength > b.strength;
  });
  return pairs;
}

bool is_rival(const EdgePair& other, const EdgePair& best) {
  if (&other == &best || other.status != GapStatus::ok) return false;
  if (same_edge(*other.frame, *best.frame) && same_edge(*other.pane, *best.pane)) return false;
  return other.strength > rival_strength * best.strength;
}

// ---- what is wrong

std::string fault_of(const GapSearch& search) {
  if (!search.centre_px.allFinite() || !std::isfinite(search.direction_rad))
    return "the window's centre or direction is not a finite number";
  if (!(search.half_across_px >= 4 && search.half_along_px >= 4) || !std::isfinite(search.half_across_px) ||
      !std::isfinite(search.half_along_px))
    return "the window's half sizes must be at least 4 px";
  if (!(search.min_gap_mm > 0 && search.max_gap_mm > search.min_gap_mm))
    return "the expected gap must be a range of positive numbers, it is " + number(search.min_gap_mm) +
           " to " + number(search.max_gap_mm) + " mm";
  if (!(search.direction_tolerance_rad > 0 && search.direction_tolerance_rad < 1) ||
      !(search.max_wedge_rad > 0 && search.max_wedge_rad < 1))
    return "the limits of direction and wedge must lie between 0 and 1 rad";
  if (!(search.min_length_share > 0 && search.min_length_share <= 1) || !(search.min_contrast > 0) ||
      !(search.max_blur_px > 0))
    return "the limits of length share (0 to 1), contrast and blur must be positive";
  return {};
}

std::string fault_of(const GapProblem& problem, const PlaneView& view) {
  const CameraModel& model = problem.camera.model;
  if (!(model.fx_px > 0 && model.fy_px > 0) || !problem.camera.X_WC.matrix().allFinite())
    return "the camera's calibration is not usable";
  if (problem.image.width_px != model.width_px || problem.image.height_px != model.height_px)
    return "the image has " + number(problem.image.width_px) + " x " + number(problem.image.height_px) +
           " px, the camera was calibrated with " + number(model.width_px) + " x " + number(model.height_px);
  if (!problem.plane.p_H_mm.allFinite() || !(problem.plane.n_H.norm() > 0) || !problem.plane.n_H.allFinite())
    return "the plane's point or normal is not usable";
  if (std::string fault = fault_of(problem.search); !fault.empty()) return fault;
  if (!view.place(problem.search.centre_px))
    return "the line of sight through the window's centre does not meet the plane, or along it";
  return {};
}

GapResult& refused(GapResult& result, GapStatus status, std::string reason) {
  result.status = status;
  result.reason = std::move(reason);
  return result;
}

// One of the edges is missing: why.
GapResult& missing(GapResult& result, const GapProblem& problem, bool frame) {
  const MarkFinding& finding = (frame ? result.frame : result.pane).finding;
  const MarkSearch search = search_for(problem.search, frame ? problem.search.frame : problem.search.pane);
  const GapStatus status = finding.status == MarkStatus::outside_image  ? GapStatus::outside_image
                           : finding.status == MarkStatus::low_contrast ? GapStatus::low_contrast
                                                                        : GapStatus::edge_not_found;
  return refused(
      result, status,
      std::string(frame ? "the frame's" : "the pane's") + " edge: " + reason_text(finding, search));
}

std::string reason_of(const EdgePair& pair, const GapSearch& search) {
  const std::string gap = number(pair.gap.gap_mm, 3) + " mm";
  const std::string range = number(search.min_gap_mm) + " to " + number(search.max_gap_mm) + " mm";
  switch (pair.status) {
    case GapStatus::outside_window:
      return "the edges pass " + number(place_in_window(*pair.frame, search), 1) + " (frame) and " +
             number(place_in_window(*pair.pane, search), 1) +
             " px (pane) from the window's centre, which has " + number(search.half_across_px, 1) +
             " px to each side";
    case GapStatus::overlap:
      return "the pane's edge lies beyond the frame's: the gap is " + gap + ", expected " + range;
    case GapStatus::out_of_range:
      return "the gap is " + gap + ", expected " + range;
    case GapStatus::not_parallel:
      return "the edges are turned against each other by " + degrees(pair.gap.wedge_rad) + ", at most " +
             degrees(search.max_wedge_rad);
    default:
      return {};
  }
}

std::string reason_of_rival(const EdgePair& other, const EdgePair& best) {
  const bool frame = !stands(other.frame->mark);
  return "several pairs of edges may be the gap: " + number(best.gap.gap_mm, 3) + " or " +
         number(other.gap.gap_mm, 3) + " mm, the second as strong by " +
         number(100 * other.strength / best.strength, 0) + " %" +
         (other.sound()
              ? std::string()
              : std::string(" though ") + (frame ? "the frame's" : "the pane's") + " edge there is " +
                    std::string(name_of((frame ? other.frame : other.pane)->mark.status))) +
         "; choose a smaller window or a smaller range";
}

void fill(const PlaneView& view, const GapProblem& problem, const EdgePair& pair, GapResult& result) {
  const Pose& X_HC = problem.camera.X_WC;
  const auto fill_edge = [&](const EdgeFinding& edge, const PlaneLine& line, GapEdge& out) {
    out.finding = edge.mark;
    out.line_covariance = covariance_of(edge);
    out.p_H_mm = X_HC * view.point_C(line.at);
    out.along_H = X_HC.linear() * view.direction_C(line.along);
  };
  fill_edge(*pair.frame, pair.gap.frame, result.frame);
  fill_edge(*pair.pane, pair.gap.pane, result.pane);
  result.gap_mm = pair.gap.gap_mm;
  result.wedge_rad = pair.gap.wedge_rad;
  result.outward_H = -(X_HC.linear() * view.direction_C(pair.gap.across));
  if (const auto C = covariance_of(view, problem.search, *pair.frame, *pair.pane)) {
    result.sigma_mm = std::sqrt((*C)(0, 0));
    result.wedge_sigma_rad = std::sqrt((*C)(1, 1));
  }
}

// The best pair against the others.
GapResult& judge(const GapProblem& problem, const std::vector<EdgePair>& pairs, GapResult& result) {
  const EdgePair& best = pairs.front();
  if (best.status != GapStatus::ok) return refused(result, best.status, reason_of(best, problem.search));
  for (const bool frame : {true, false})
    if (const MarkFinding& edge = (frame ? best.frame : best.pane)->mark; edge.status != MarkStatus::found)
      return missing(result, problem, frame);
    else if (edge.quality < least_quality)
      return refused(result, GapStatus::edge_not_found,
                     std::string(frame ? "the frame's" : "the pane's") +
                         " edge fits its pixels badly: quality " + number(edge.quality) + ", at least " +
                         number(least_quality) + " is needed");
  for (const EdgePair& other : pairs)
    if (is_rival(other, best)) return refused(result, GapStatus::ambiguous, reason_of_rival(other, best));
  if (!(result.sigma_mm > 0))
    return refused(result, GapStatus::edge_not_found, "the edges' covariance is not usable");
  result.status = GapStatus::ok;
  return result;
}

}  // namespace

std::string_view name_of(GapStatus status) {
  constexpr std::array<std::string_view, 11> names{
      "failed",         "ok",           "wrong_problem", "outside_image",
      "edge_not_found", "low_contrast", "ambiguous",     "outside_window",
      "not_parallel",   "overlap",      "out_of_range"};
  return names[std::min(static_cast<std::size_t>(status), names.size() - 1)];
}

GapResult measure_gap(const GapProblem& problem) {
  GapResult result;
  const PlaneView view(problem.camera, problem.plane);
  if (std::string fault = fault_of(problem, view); !fault.empty())
    return refused(result, GapStatus::wrong_problem, std::move(fault));
  const EdgeSight frames =
      look_for_edge_lines(problem.image, search_for(problem.search, problem.search.frame), {most_edges});
  const EdgeSight panes =
      look_for_edge_lines(problem.image, search_for(problem.search, problem.search.pane), {most_edges});
  result.frame.finding = frames.nearest;
  result.pane.finding = panes.nearest;
  if (frames.standing.empty()) return missing(result, problem, true);
  if (panes.standing.empty()) return missing(result, problem, false);
  const std::vector<EdgePair> pairs = pairs_of(view, problem.search, frames, panes);
  if (pairs.empty() || !pairs.front().sound())
    return refused(result, GapStatus::edge_not_found,
                   "one edge is seen where the frame's and the pane's are expected");
  fill(view, problem, pairs.front(), result);
  return judge(problem, pairs, result);
}

}  // namespace zeropose
