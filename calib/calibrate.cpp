// C7: the whole way from points to a camera.
#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "calib/calibration.h"
#include "calib/calibration_checks.h"
#include "calib/held_values.h"
#include "calib/linear_methods.h"
#include "calib/origin_search.h"
#include "calib/point_layout.h"
#include "calib/refine.h"
#include "calib/words.h"

namespace zeropose {
namespace {

using Eigen::Vector2d;
using enum CalibrationStatus;

constexpr std::size_t few_points = 50;
constexpr int settling_rounds = 50;
constexpr double settled_origin_px = 1e-3, settled_lens = 1e-7;
const ParameterSet origin_parameters{Parameter::cx, Parameter::cy};

// The way through one set of points: state and record.
struct Way {
  std::span<const CalibrationPoint> points;  // those used
  PointLayout layout;
  CalibrationStatus status = failed;
  std::string reason;
  CameraModel model;
  Pose X_WC = Pose::Identity();
  RefineResult refined;  // status failed: there was none
  double condition = 0;
  std::vector<CalibrationStep> steps;
  std::vector<std::string> warnings;

  void fail(CalibrationStatus with, std::string why) {
    status = with;
    reason = std::move(why);
  }
  void note(std::string name, std::string detail) {
    steps.push_back({std::move(name), std::move(detail), rms_of(deviations_of(points, model, X_WC))});
  }
};

Vector2d first_origin(const CalibrationProblem& problem) {
  if (problem.origin_px) return *problem.origin_px;
  if (problem.start) return {problem.start->model.cx_px, problem.start->model.cy_px};
  return {0.5 * (problem.width_px - 1), 0.5 * (problem.height_px - 1)};
}

double aspect_of(const CalibrationProblem& problem) {
  if (problem.one_focal || !problem.start) return 1;
  return problem.start->model.fx_px / problem.start->model.fy_px;
}

bool holds_origin(const CalibrationProblem& problem) {
  return problem.fixed.has(Parameter::cx) || problem.fixed.has(Parameter::cy);
}

CalibrationMethod method_for(const CalibrationProblem& problem, const Way& way) {
  if (problem.method != CalibrationMethod::automatic) return problem.method;
  if (way.layout.coplanar) return CalibrationMethod::coplanar;
  const bool straight = problem.fixed.has(Parameter::K) && problem.lens == LensModel::division &&
                        (!problem.start || std::get<Division>(problem.start->model.distortion).K == 0);
  constexpr std::size_t enough_for_tsai = 7;
  return straight || way.points.size() < enough_for_tsai ? CalibrationMethod::linear
                                                         : CalibrationMethod::noncoplanar;
}

std::string origin_text(const Vector2d& origin_px) {
  return "origin " + number(origin_px.x()) + ", " + number(origin_px.y()) + " px";
}

std::string internals_text(const CameraModel& model) {
  std::string text = "fx " + number(model.fx_px) + ", fy " + number(model.fy_px) + " px, " +
                     origin_text({model.cx_px, model.cy_px});
  if (const auto* lens = std::get_if<Division>(&model.distortion)) text += ", K " + number(lens->K, 6);
  if (const auto* lens = std::get_if<BrownConrady>(&model.distortion))
    text += ", k1 " + number(lens->k1, 6) + ", k2 " + number(lens->k2, 6);
  return text;
}

// --- the linear start

LinearResult linear_start(const CalibrationProblem& problem, CalibrationMethod method, const Way& way,
                          const Vector2d& origin_px) {
  LinearProblem linear{way.points, origin_px, aspect_of(problem), problem.tz_mm, {}};
  if (problem.start && problem.fixed.has(Parameter::fy)) linear.fy_px = problem.start->model.fy_px;
  if (method == CalibrationMethod::linear) return calibrate_linear(linear);
  if (method == CalibrationMethod::noncoplanar) return calibrate_noncoplanar(linear);
  // What lies off the plane takes part in the refinement, not here.
  std::vector<CalibrationPoint> in_plane;
  for (const std::size_t i : way.layout.in_plane) in_plane.push_back(way.points[i]);
  linear.points = in_plane;
  return calibrate_coplanar(linear, way.layout.X_WP);
}

std::string plane_text(const Way& way) {
  return number(way.layout.in_plane.size()) + " of " + number(way.points.size()) + " points lie within " +
         number(way.layout.thickness_mm, 3) + " mm of one plane, they span " +
         number(way.layout.extent_mm.x(), 1) + " mm";
}

bool method_suits(CalibrationMethod method, Way& way) {
  if (method == CalibrationMethod::coplanar && !way.layout.coplanar) {
    way.fail(wrong_problem,
             "the method coplanar was asked for, but only " + plane_text(way) + "; use noncoplanar or auto");
    return false;
  }
  if (method != CalibrationMethod::coplanar && way.layout.coplanar) {
    way.fail(coplanar, plane_text(way) +
                           ": the method needs points with depth; use coplanar or auto, or add points off "
                           "the plane");
    return false;
  }
  return true;
}

std::string_view name_of(CalibrationMethod method) {
  if (method == CalibrationMethod::coplanar) return "C1 coplanar";
  return method == CalibrationMethod::noncoplanar ? "C2 non-coplanar" : "C3 linear";
}

void start_at_origin(const CalibrationProblem& problem, CalibrationMethod method, const Vector2d& origin_px,
                     Way& way) {
  const LinearResult linear = linear_start(problem, method, way, origin_px);
  way.condition = linear.condition;
  if (linear.status != ok) return way.fail(linear.status, linear.reason);
  way.status = ok;
  way.model = linear.model;
  way.X_WC = linear.X_WC;
  way.model.width_px = problem.width_px;
  way.model.height_px = problem.height_px;
  way.model = with_held_values(problem, way.model, first_origin(problem));
  way.X_WC = with_held_pose(problem, way.X_WC);
}

// --- refinement

bool shares_focal(const CalibrationProblem& problem, const Way& way) {
  const bool held = problem.fixed.has_all({Parameter::fx, Parameter::fy});
  return problem.one_focal || (way.layout.coplanar && !held);
}

void refine_way(const CalibrationProblem& problem, const ParameterSet& also_fixed, Way& way) {
  RefineProblem refinement{
      way.points,       way.model,     way.X_WC, problem.fixed, shares_focal(problem, way),
      problem.residual, problem.robust};
  refinement.fixed.add(also_fixed);
  if (problem.one_focal && !problem.fixed.has(Parameter::fx) && !problem.fixed.has(Parameter::fy))
    refinement.start.fx_px = refinement.start.fy_px =
        std::sqrt(refinement.start.fx_px * refinement.start.fy_px);
  way.refined = refine(refinement);
  way.condition = way.refined.condition;
  if (way.refined.status != ok) return way.fail(way.refined.status, way.refined.reason);
  way.model = way.refined.model;
  way.X_WC = way.refined.X_WC;
}

// The origin by C5, then the linear method there.
void search_way(const CalibrationProblem& problem, CalibrationMethod method, Way& way) {
  const OriginProblem search{way.points, {way.model.cx_px, way.model.cy_px}, aspect_of(problem)};
  const OriginResult found = search_origin(search, way.layout);
  if (found.status != ok) return way.fail(found.status, found.reason);
  start_at_origin(problem, method, found.origin_px, way);
  if (way.status != ok) return;
  way.note("C5 origin search",
           origin_text(found.origin_px) + " after " + number(found.evaluations) + " trials");
}

// Origin by search, the rest refined, until the origin stands still.
void refine_distortion_dominant(const CalibrationProblem& problem, CalibrationMethod method, Way& way) {
  const bool search = !holds_origin(problem) && (!way.layout.coplanar || problem.search_origin);
  for (int round = 0; round < settling_rounds; ++round) {
    const Vector2d before(way.model.cx_px, way.model.cy_px);
    if (search) search_way(problem, method, way);
    if (way.status != ok) return;
    const bool settled = (Vector2d(way.model.cx_px, way.model.cy_px) - before).norm() < settled_origin_px;
    if (round > 0 && settled) break;
    refine_way(problem, origin_parameters, way);
    if (way.status != ok || !search) return;
  }
  refine_way(problem, origin_parameters, way);
}

double lens_strength(const CameraModel& model) {
  if (const auto* lens = std::get_if<Division>(&model.distortion)) return lens->K;
  return std::get<BrownConrady>(model.distortion).k1;
}

// The lens held and the rest refined, then the origin held, in turns: slow, kept for comparison.
void refine_origin_dominant(const CalibrationProblem& problem, Way& way) {
  for (int round = 0; round < settling_rounds; ++round) {
    const Vector2d origin(way.model.cx_px, way.model.cy_px);
    const double lens = lens_strength(way.model);
    refine_way(problem, lens_parameters, way);
    if (way.status != ok) return;
    const bool origin_settled =
        (Vector2d(way.model.cx_px, way.model.cy_px) - origin).norm() < settled_origin_px;
    refine_way(problem, origin_parameters, way);
    if (way.status != ok) return;
    if (origin_settled && std::abs(lens_strength(way.model) - lens) < settled_lens) return;
  }
  way.warnings.push_back("origin-dominant: lens and origin still moved after " + number(settling_rounds) +
                         " rounds");
}

Refinement refinement_for(const CalibrationProblem& problem, const Way& way) {
  if (problem.refinement != Refinement::automatic) return problem.refinement;
  const bool few = way.points.size() < few_points || way.layout.coplanar;
  return few ? Refinement::distortion_dominant : Refinement::joint;
}

void refine_by_strategy(const CalibrationProblem& problem, CalibrationMethod method, Way& way) {
  const Refinement refinement = refinement_for(problem, way);
  const bool search = problem.search_origin && !holds_origin(problem);
  if (search && refinement != Refinement::distortion_dominant) search_way(problem, method, way);
  if (way.status != ok || refinement == Refinement::none) return;
  if (refinement == Refinement::joint) refine_way(problem, {}, way);
  if (refinement == Refinement::distortion_dominant) refine_distortion_dominant(problem, method, way);
  if (refinement == Refinement::origin_dominant) refine_origin_dominant(problem, way);
  if (way.status != ok) return;
  const char* const name = refinement == Refinement::joint ? "C6 refinement, joint"
                           : refinement == Refinement::distortion_dominant
                               ? "C6 refinement, distortion-dominant"
                               : "C6 refinement, origin-dominant";
  way.note(name, internals_text(way.model));
}

// The sigma of everything that is not held by the user, also where a strategy held it in turns.
void widen_uncertainty(const CalibrationProblem& problem, Way& way) {
  RefineProblem all{way.points,       way.model,      way.X_WC, problem.fixed, shares_focal(problem, way),
                    problem.residual, problem.robust, 0};
  const RefineResult at = refine(all);
  if (at.uncertainty.parameters.empty()) {
    way.warnings.push_back("the sigmas hold for the image origin as it is: " + at.reason);
    return;
  }
  way.refined.uncertainty = at.uncertainty;
  way.condition = way.refined.condition = at.condition;
}

Way go(const CalibrationProblem& problem, std::span<const CalibrationPoint> points) {
  Way way;
  way.points = points;
  way.layout = layout_of(points);
  const bool given = problem.start && problem.start->X_WC && problem.method == CalibrationMethod::automatic;
  const CalibrationMethod method = method_for(problem, way);
  if (given) {
    way.status = ok;
    way.model = problem.start->model;
    way.X_WC = *problem.start->X_WC;
    if (problem.origin_px) {
      way.model.cx_px = problem.origin_px->x();
      way.model.cy_px = problem.origin_px->y();
    }
    way.note("start as given", internals_text(way.model));
  } else if (method_suits(method, way)) {
    start_at_origin(problem, method, first_origin(problem), way);
    if (way.status == ok) way.note(std::string(name_of(method)), internals_text(way.model));
  }
  if (way.status != ok) return way;
  refine_by_strategy(problem, method, way);
  if (way.status == ok && way.refined.status == ok && refinement_for(problem, way) != Refinement::joint)
    widen_uncertainty(problem, way);
  return way;
}

// --- the result

// The worst points above the threshold: at most those within a factor of two of the worst, because one bad
// point draws good ones with it.
std::vector<std::size_t> to_reject(const CalibrationProblem& problem,
                                   const std::vector<CalibrationDeviation>& deviations) {
  const auto excess = [&](const CalibrationDeviation& deviation) {
    if (!deviation.dev_px.allFinite()) return std::numeric_limits<double>::infinity();
    double worst = 0;
    if (problem.reject_px > 0) worst = deviation.dev_px.norm() / problem.reject_px;
    if (problem.reject_mm > 0) worst = std::max(worst, deviation.dev_mm.norm() / problem.reject_mm);
    return worst;
  };
  double worst = 1;
  for (const CalibrationDeviation& deviation : deviations) worst = std::max(worst, excess(deviation));
  std::vector<std::size_t> rejected;
  if (!(problem.reject_px > 0 || problem.reject_mm > 0)) return rejected;
  for (std::size_t i = 0; i < deviations.size(); ++i)
    if (excess(deviations[i]) > 1 && excess(deviations[i]) >= 0.5 * worst) rejected.push_back(i);
  return rejected;
}

void scale_uncertainty(const CalibrationProblem& problem, const Way& way, CalibrationResult& result) {
  const double equations = 2.0 * static_cast<double>(way.points.size());
  const double freedom = equations - static_cast<double>(way.refined.uncertainty.parameters.size());
  const double of_residuals = freedom > 0 ? std::sqrt(way.refined.cost / freedom) : 0;
  double of_pixels = of_residuals;
  if (problem.residual == Residual::algebraic)
    of_pixels = freedom > 0 ? result.rms_px * std::sqrt(0.5 * equations / freedom) : 0;
  result.sigma_px = problem.sigma_px > 0 ? problem.sigma_px : of_pixels;
  const double factor = of_residuals > 0 && of_pixels > 0 ? of_residuals / of_pixels : 1;
  result.uncertainty = way.refined.uncertainty;
  result.uncertainty.covariance *= std::pow(factor * result.sigma_px, 2);
  if (!(result.sigma_px > 0)) {
    result.uncertainty = {};
    result.diagnosis.warnings.push_back(
        "as many parameters as equations: no sigma follows from the residuals; give sigma_px");
  }
}

CalibrationResult result_of(const CalibrationProblem& problem, const std::vector<std::size_t>& used,
                            Way way) {
  CalibrationResult result;
  result.status = way.status;
  result.reason = way.reason;
  result.steps = way.steps;
  result.diagnosis = {way.condition, way.layout.coplanar, std::move(way.warnings)};
  if (way.status != ok) return result;
  result.model = way.model;
  result.X_WC = way.X_WC;
  result.deviations = deviations_of(problem.points, way.model, way.X_WC);
  for (const std::size_t i : used) result.deviations[i].used = true;
  result.rms_px = rms_of(deviations_of(way.points, way.model, way.X_WC));
  result.residual_sum = result.rms_px * result.rms_px * static_cast<double>(way.points.size());
  if (way.refined.status == ok) {
    result.residual_sum = way.refined.cost;
    scale_uncertainty(problem, way, result);
  }
  add_warnings(problem, way.layout, result);
  return result;
}

}  // namespace

CalibrationResult calibrate(const CalibrationProblem& problem) {
  CalibrationResult wrong;
  if (const auto fault = options_fault(problem)) {
    wrong.status = fault->status;
    wrong.reason = fault->reason;
    return wrong;
  }
  std::vector<std::size_t> used(problem.points.size());
  std::iota(used.begin(), used.end(), std::size_t{0});
  std::vector<CalibrationStep> rejections;
  for (;;) {
    std::vector<CalibrationPoint> points;
    for (const std::size_t i : used) points.push_back(problem.points[i]);
    CalibrationProblem part = problem;
    part.points = points;
    if (const auto fault = fault_of(part)) {
      wrong.status = fault->status;
      wrong.reason = fault->reason;
      wrong.steps = rejections;
      return wrong;
    }
    Way way = go(problem, points);
    way.steps.insert(way.steps.begin(), rejections.begin(), rejections.end());
    const auto deviations = deviations_of(points, way.model, way.X_WC);
    const auto rejected = way.status == ok ? to_reject(problem, deviations) : std::vector<std::size_t>{};
    if (rejected.empty()) return result_of(problem, used, std::move(way));
    std::string names;
    for (auto i = rejected.rbegin(); i != rejected.rend(); ++i) {
      names = number(used[*i] + 1) + (names.empty() ? "" : ", ") + names;
      used.erase(used.begin() + static_cast<std::ptrdiff_t>(*i));
    }
    rejections.push_back({"rejected points", names, rms_of(deviations)});
  }
}

}  // namespace zeropose
