#include "calib/views_report.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "calib/eccentricity.h"
#include "calib/views_stage_axes.h"
#include "calib/views_uncertainty.h"
#include "calib/words.h"

namespace zeropose::bundle {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using Status = CalibrationStatus;

constexpr double focal_refused = 0.1, focal_doubtful = 0.01;    // sigma as part of the focal length
constexpr double origin_refused = 0.2, origin_doubtful = 0.01;  // sigma as part of the image width
constexpr double nearly_parallel_deg = 3, little_tilt_deg = 10;
constexpr double correlated = 0.98;

std::string of_camera(const ViewsProblem& problem, std::size_t camera) {
  return problem.cameras.size() > 1 ? " of camera \"" + problem.cameras[camera].name + "\"" : "";
}

// The boards that a camera sees, by their normals in its frame, towards the camera.
std::vector<Vector3d> normals_of(const State& state, std::span<const Chunk> chunks, std::size_t camera,
                                 bool& any_depth) {
  std::vector<Vector3d> normals;
  for (const Chunk& chunk : chunks) {
    if (chunk.camera != camera) continue;
    std::vector<Vector3d> points;
    for (const SeenPoint& point : chunk.points) points.push_back(point.p_B_mm);
    const BestPlane plane = best_plane(points);
    any_depth = any_depth || plane.flatness() > flat;
    const Vector3d n = state.X_WC[camera].linear().transpose() * state.X_WB[chunk.view].linear() *
                       plane.X_GP.linear().col(2);
    normals.push_back(n.z() > 0 ? Vector3d(-n) : n);
  }
  return normals;
}

double largest_angle_deg(const std::vector<Vector3d>& directions, const Vector3d& to) {
  double largest = 0;
  for (const Vector3d& d : directions)
    largest = std::max(largest, std::acos(std::min(1.0, std::abs(d.dot(to)))) * degrees_per_radian);
  return largest;
}

struct Boards {
  bool planes = false;  // nothing but planes
  std::size_t count = 0;
  double tilt_deg = 0;     // largest, against the chip
  double between_deg = 0;  // largest, against the first
};

Boards boards_of(const State& state, std::span<const Chunk> chunks, std::size_t camera) {
  bool any_depth = false;
  const std::vector<Vector3d> normals = normals_of(state, chunks, camera, any_depth);
  if (normals.empty()) return {};
  return {!any_depth, normals.size(), largest_angle_deg(normals, Vector3d::UnitZ()),
          largest_angle_deg(normals, normals.front())};
}

// Why the internals of this camera are not determined, as far as the layout tells.
Verdict weak_layout(const ViewsProblem& problem, const Boards& boards, std::size_t camera,
                    const std::string& what) {
  const std::string of = of_camera(problem, camera);
  if (boards.planes && boards.tilt_deg < nearly_parallel_deg)
    return refused(Status::parallel_to_chip,
                   "all boards" + of + " are nearly parallel to the chip (largest tilt " +
                       number(boards.tilt_deg) + " deg): focal length and distance cannot be told apart");
  if (boards.planes && boards.count > 1 && boards.between_deg < nearly_parallel_deg)
    return refused(Status::not_determined, "all boards" + of + " are nearly parallel to each other (within " +
                                               number(boards.between_deg) + " deg): " + what +
                                               " not determined; tilt the board");
  const auto free = free_internals(problem.cameras[camera]);
  const auto linear = static_cast<std::size_t>(
      std::ranges::count_if(free, [](Parameter parameter) { return parameter <= Parameter::cy; }));
  if (boards.planes && 2 * boards.count < linear)
    return refused(Status::not_determined, "too few views" + of + ": " + number(boards.count) +
                                               " of a plane determine " + number(2 * boards.count) +
                                               " of focal lengths and origin, " + number(linear) +
                                               " are free; " + what + " not determined");
  return refused(Status::not_determined, what + of + " not determined by these points");
}

// Sigmas of focal lengths and origin against what they are good for.
struct Doubt {
  double focal = 0, origin = 0;  // relative
};

Doubt doubt_of(const ViewsCamera& camera, const CameraModel& model, const Eigen::MatrixXd& covariance,
               double sigma_px) {
  Doubt doubt;
  const std::vector<Parameter> parameters = free_internals(camera);
  for (std::size_t k = 0; k < parameters.size(); ++k) {
    const auto i = static_cast<Eigen::Index>(k);
    const double sigma = sigma_px * std::sqrt(std::max(0.0, covariance(i, i)));
    if (parameters[k] == Parameter::fx) doubt.focal = std::max(doubt.focal, sigma / model.fx_px);
    if (parameters[k] == Parameter::fy) doubt.focal = std::max(doubt.focal, sigma / model.fy_px);
    if (parameters[k] == Parameter::cx || parameters[k] == Parameter::cy)
      doubt.origin = std::max(doubt.origin, sigma / model.width_px);
  }
  return doubt;
}

Verdict check_determined(const ViewsProblem& problem, const State& state, std::span<const Chunk> chunks,
                         const Freedom& freedom, const UncertaintyAnswer& answer, double sigma_px) {
  if (freedom.stage)
    if (const std::string unknown = unknown_axes(problem, state, chunks, freedom, answer); !unknown.empty())
      return refused(Status::not_determined, unknown);
  for (std::size_t c = 0; c < problem.cameras.size(); ++c) {
    const Boards boards = boards_of(state, chunks, c);
    if (!answer.found) {
      const Verdict verdict = weak_layout(problem, boards, c, answer.weak);
      const bool last = c + 1 == problem.cameras.size();
      if (last || verdict.status == Status::parallel_to_chip) return verdict;
      continue;
    }
    const Doubt doubt = doubt_of(problem.cameras[c], state.models[c], answer.found->internals[c],
                                 std::max(sigma_px, least_sigma_px));
    if (doubt.focal > focal_refused)
      return weak_layout(problem, boards, c,
                         "the focal length (sigma " + number(100 * doubt.focal, 0) + " %)");
    if (doubt.origin > origin_refused)
      return weak_layout(problem, boards, c,
                         "the image origin (sigma " + number(100 * doubt.origin, 0) + " % of the width)");
  }
  return {};
}

struct Mean {
  double sum = 0, count = 0;
  double root() const { return count > 0 ? std::sqrt(sum / count) : 0; }
  void add(double square) { sum += square, count += 1; }
};

void set_deviations(ViewsResult& result, const ViewsProblem& problem, const State& state,
                    std::span<const Chunk> chunks) {
  result.deviations.resize(problem.points.size());
  for (std::size_t i = 0; i < problem.points.size(); ++i)
    result.deviations[i] = deviation_of(state, problem.points[i]).value_or(CalibrationDeviation{});
  Mean all;
  std::vector<Mean> cameras(problem.cameras.size()), views(problem.views.size());
  for (const Chunk& chunk : chunks)
    for (const SeenPoint& point : chunk.points) {
      CalibrationDeviation& deviation = result.deviations[point.index];
      deviation.used = true;
      const double square = deviation.dev_px.squaredNorm();
      all.add(square);
      cameras[chunk.camera].add(square);
      views[chunk.view].add(square);
    }
  result.rms_px = all.root();
  for (std::size_t c = 0; c < cameras.size(); ++c) result.cameras[c].rms_px = cameras[c].root();
  for (std::size_t v = 0; v < views.size(); ++v) {
    result.views[v].rms_px = views[v].root();
    result.views[v].points_used = static_cast<std::size_t>(views[v].count);
  }
}

void set_estimates(ViewsResult& result, const ViewsProblem& problem, const State& state,
                   const Uncertainty& uncertainty) {
  const double s2 = result.sigma_px * result.sigma_px;
  for (std::size_t c = 0; c < problem.cameras.size(); ++c)
    result.cameras.push_back({state.models[c],
                              state.X_WC[c],
                              {free_internals(problem.cameras[c]), s2 * uncertainty.internals[c]},
                              s2 * uncertainty.cameras[c],
                              0});
  for (std::size_t v = 0; v < problem.views.size(); ++v)
    result.views.push_back({state.X_WB[v], s2 * uncertainty.views[v], 0, 0});
}

void warn_of_correlation(const ViewsProblem& problem, const CameraEstimate& camera, std::size_t index,
                         std::vector<std::string>& warnings) {
  const Eigen::MatrixXd& C = camera.internals.covariance;
  for (Eigen::Index i = 0; i < C.rows(); ++i)
    for (Eigen::Index j = 0; j < i; ++j) {
      const double r = C(i, j) / std::sqrt(C(i, i) * C(j, j));
      const Parameter a = camera.internals.parameters[static_cast<std::size_t>(j)];
      const Parameter b = camera.internals.parameters[static_cast<std::size_t>(i)];
      // The radial coefficients always go with each other, and so do the focal lengths: no news.
      const bool radial = a >= Parameter::k1 && b >= Parameter::k1;
      const bool focal = a == Parameter::fx && b == Parameter::fy;
      if (std::abs(r) > correlated && !radial && !focal)
        warnings.push_back(std::string(name_of(a)) + " and " + std::string(name_of(b)) +
                           of_camera(problem, index) + " are correlated by " + number(r, 3));
    }
}

void warn_of_camera(const ViewsProblem& problem, const State& state, std::span<const Chunk> chunks,
                    std::size_t c, const Uncertainty& uncertainty, ViewsResult& result) {
  std::vector<std::string>& warnings = result.diagnosis.warnings;
  const ViewsCamera& camera = problem.cameras[c];
  const std::string of = of_camera(problem, c);
  const Boards boards = boards_of(state, chunks, c);
  const Doubt doubt = doubt_of(camera, state.models[c], uncertainty.internals[c], result.sigma_px);
  if (doubt.focal > focal_doubtful)
    warnings.push_back("the focal length" + of + " is known to " + number(100 * doubt.focal, 1) + " % only");
  if (doubt.origin > origin_doubtful)
    warnings.push_back("the image origin" + of + " is known to " + number(doubt.origin * camera.width_px, 1) +
                       " px only");
  if (boards.planes && boards.count < 3)
    warnings.push_back("only " + number(boards.count) + " views of a plane" + of + ": take at least three");
  if (boards.planes && boards.tilt_deg < little_tilt_deg)
    warnings.push_back("no board" + of + " is tilted by more than " + number(boards.tilt_deg, 1) +
                       " deg against the chip: the focal length rests on little");
  Eigen::AlignedBox2d box;
  for (const Chunk& chunk : chunks)
    for (const SeenPoint& point : chunk.points)
      if (chunk.camera == c) box.extend(point.u_px);
  const double covered = box.volume() / (static_cast<double>(camera.width_px) * camera.height_px);
  if (covered < 0.4)
    warnings.push_back("the points" + of + " cover " + number(100 * covered, 0) +
                       " % of the image: outside them the lens is extrapolated");
  warn_of_correlation(problem, result.cameras[c], c, warnings);
}

void warn_of_views(const ViewsProblem& problem, ViewsResult& result) {
  for (std::size_t v = 0; v < problem.views.size(); ++v)
    if (problem.views.size() > 2 && result.views[v].rms_px > 3 * result.rms_px)
      result.diagnosis.warnings.push_back("view \"" + problem.views[v].name + "\" fits three times worse (" +
                                          number(result.views[v].rms_px) + " px) than all together");
}

}  // namespace

std::optional<CalibrationDeviation> deviation_of(const State& state, const ViewPoint& seen) {
  const CameraModel& model = state.models[seen.camera];
  const Pose X_CB = state.X_WC[seen.camera].inverse() * state.X_WB[seen.view];
  const Vector3d p_C = X_CB * seen.point.p_W_mm;
  const auto u_px = project(model, p_C);
  if (!u_px) return std::nullopt;
  CalibrationDeviation deviation;
  deviation.dev_px =
      seen.point.u_px - *u_px -
      ellipse_centre_offset(model, p_C, X_CB.linear() * seen.point.disc_normal_W, seen.point.disc_radius_mm);
  deviation.dev_mm = deviation.dev_px.cwiseQuotient(Vector2d(model.fx_px, model.fy_px)) * p_C.z();
  deviation.depth_mm = p_C.z();
  return deviation;
}

ViewsResult report_of(const ViewsProblem& problem, const State& state, std::span<const Chunk> chunks,
                      const Freedom& freedom) {
  ViewsResult result;
  const UncertaintyAnswer answer = uncertainty_of(problem, state, chunks, freedom, problem.robust);
  result.residual_sum = cost_of(state, chunks, 0);
  const Scatter scatter = scatter_of(problem, chunks, result.residual_sum, answer);
  result.sigma_px = scatter.sigma_px;
  const Verdict verdict = check_determined(problem, state, chunks, freedom, answer, result.sigma_px);
  if (verdict.status != Status::ok || !answer.found) {
    result.status = verdict.status == Status::ok ? Status::not_determined : verdict.status;
    result.reason = verdict.reason;
    return result;
  }
  result.status = Status::ok;
  result.diagnosis.condition = answer.found->condition;
  set_estimates(result, problem, state, *answer.found);
  set_deviations(result, problem, state, chunks);
  result.diagnosis.coplanar = true;
  for (std::size_t c = 0; c < problem.cameras.size(); ++c) {
    result.diagnosis.coplanar = result.diagnosis.coplanar && boards_of(state, chunks, c).planes;
    warn_of_camera(problem, state, chunks, c, *answer.found, result);
  }
  warn_of_views(problem, result);
  if (freedom.stage)
    result.stage = stage_estimate(problem, state, chunks, freedom, *answer.found);
  else
    check_stage(problem, state, chunks, freedom, scatter.redundancy, result);
  if (result.stage) warn_of_stage(result);
  return result;
}

}  // namespace zeropose::bundle
