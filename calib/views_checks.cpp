#include "calib/views_checks.h"

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numeric>
#include <optional>

#include "calib/symmetric_eigen.h"
#include "calib/words.h"

namespace zeropose::bundle {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using Status = CalibrationStatus;

constexpr std::size_t fewest_points = 4;
constexpr double line = 1e-3;            // narrower than this part of their length points lie on a line
constexpr double least_of_image = 0.05;  // of the diagonal that the pixels must span

std::string quoted(const std::string& name) { return "\"" + name + "\""; }

Verdict check_start(const ViewsCamera& camera) {
  const bool needs = camera.fixed.has(Parameter::fx) || camera.fixed.has(Parameter::fy);
  if (!camera.start) {
    if (needs) return refused(Status::wrong_problem, "fx or fy is to be held, but there is no start for it");
    return {};
  }
  const bool brown = std::holds_alternative<BrownConrady>(camera.start->distortion);
  if (brown != (camera.lens == LensModel::brown))
    return refused(Status::wrong_problem, "the start has another lens model than the camera");
  const Internals internals = internals_of(*camera.start);
  if (!internals.allFinite()) return refused(Status::not_finite, "the start holds a number that is none");
  if (!(internals[0] > 0) || !(internals[1] > 0))
    return refused(Status::wrong_problem, "the focal length of the start is not above 0");
  if (camera.one_focal && needs && internals[0] != internals[1])
    return refused(Status::wrong_problem, "one focal length is wanted, but fx and fy are held at two");
  return {};
}

Verdict check_camera(const ViewsCamera& camera) {
  if (camera.width_px <= 0 || camera.height_px <= 0)
    return refused(Status::wrong_problem, "the image has no size");
  for (const Parameter parameter :
       {Parameter::x, Parameter::y, Parameter::z, Parameter::rx, Parameter::ry, Parameter::rz})
    if (camera.fixed.has(parameter))
      return refused(Status::wrong_problem,
                     "the pose of a camera cannot be held here; give the poses of the views");
  return check_start(camera);
}

Verdict check_point(const ViewsProblem& problem, std::size_t index) {
  const ViewPoint& seen = problem.points[index];
  const std::string name = "point " + number(index + 1);
  if (seen.view >= problem.views.size() || seen.camera >= problem.cameras.size())
    return refused(Status::wrong_problem, name + " names a view or camera that is not there");
  const CalibrationPoint& point = seen.point;
  const bool finite = point.p_W_mm.allFinite() && point.u_px.allFinite() &&
                      point.covariance_px2.allFinite() && std::isfinite(point.disc_radius_mm) &&
                      point.disc_normal_W.allFinite();
  if (!finite) return refused(Status::not_finite, name + " holds a number that is none");
  const Eigen::LLT<Eigen::Matrix2d> llt(point.covariance_px2);
  if (llt.info() != Eigen::Success ||
      std::abs(point.covariance_px2(0, 1) - point.covariance_px2(1, 0)) > 1e-12)
    return refused(Status::wrong_problem, name + ": its covariance is none");
  return {};
}

Verdict check_view(const BoardView& view) {
  if (!view.X_WB) return {};
  if (!view.X_WB->matrix().allFinite())
    return refused(Status::not_finite, "its known pose holds a number that is none");
  const Eigen::Matrix3d R = view.X_WB->linear();
  if ((R * R.transpose() - Eigen::Matrix3d::Identity()).norm() > 1e-6 || R.determinant() < 0)
    return refused(Status::wrong_problem, "its known pose is no rigid pose");
  return {};
}

Verdict with_name(Verdict verdict, const std::string& name) {
  verdict.reason = name + ": " + verdict.reason;
  return verdict;
}

using Pair = std::array<double, 5>;  // board point, pixel

Pair pair_of(const ViewsProblem& problem, const SeenPoint& seen) {
  const CalibrationPoint& point = problem.points[seen.index].point;
  return {point.p_W_mm.x(), point.p_W_mm.y(), point.p_W_mm.z(), point.u_px.x(), point.u_px.y()};
}

// One of two that agree in some of their numbers and differ in others.
std::optional<Pair> repeated(std::vector<Pair> pairs, std::size_t first, std::size_t count) {
  const auto key = [=](const Pair& pair) { return std::span(pair).subspan(first, count); };
  std::ranges::sort(pairs, [&key](const Pair& a, const Pair& b) {
    return std::ranges::lexicographical_compare(key(a), key(b));
  });
  const auto found = std::ranges::adjacent_find(
      pairs, [&key](const Pair& a, const Pair& b) { return a != b && std::ranges::equal(key(a), key(b)); });
  if (found == pairs.end()) return std::nullopt;
  return *found;
}

// The same board point at two pixels, or two board points at one.
Verdict check_repeated(const ViewsProblem& problem, const Chunk& chunk) {
  std::vector<Pair> pairs;
  for (const SeenPoint& seen : chunk.points) pairs.push_back(pair_of(problem, seen));
  auto twice = repeated(pairs, 0, 3);
  if (!twice) twice = repeated(pairs, 3, 2);
  if (!twice) return {};
  const Pair& p = *twice;
  return refused(Status::duplicate_points, name_of_chunk(problem, chunk) + ": the point (" + number(p[0]) +
                                               ", " + number(p[1]) + ", " + number(p[2]) + ") mm at pixel (" +
                                               number(p[3]) + ", " + number(p[4]) +
                                               ") is there again with another partner");
}

// Different board points, counted until they are enough.
std::size_t different_points(const Chunk& chunk) {
  std::vector<Vector3d> different;
  for (const SeenPoint& point : chunk.points) {
    if (std::ranges::find(different, point.p_B_mm) == different.end()) different.push_back(point.p_B_mm);
    if (different.size() >= fewest_points) break;
  }
  return different.size();
}

std::vector<Vector3d> board_points(const Chunk& chunk) {
  std::vector<Vector3d> points;
  for (const SeenPoint& point : chunk.points) points.push_back(point.p_B_mm);
  return points;
}

std::vector<Vector3d> pixels(const ViewsProblem& problem, const Chunk& chunk) {
  std::vector<Vector3d> points;
  for (const SeenPoint& point : chunk.points)
    points.emplace_back(problem.points[point.index].point.u_px.x(),
                        problem.points[point.index].point.u_px.y(), 0);
  return points;
}

Verdict check_span(const ViewsProblem& problem, std::size_t camera) {
  Eigen::AlignedBox2d box;
  for (const ViewPoint& seen : problem.points)
    if (seen.camera == camera) box.extend(seen.point.u_px);
  const ViewsCamera& given = problem.cameras[camera];
  const double diagonal = std::hypot(given.width_px, given.height_px);
  if (!box.isEmpty() && box.diagonal().norm() >= least_of_image * diagonal) return {};
  if (box.isEmpty())
    return refused(Status::too_few_points, "camera " + quoted(given.name) + " sees no points");
  return refused(Status::all_in_centre, "camera " + quoted(given.name) + ": all points lie within " +
                                            number(box.diagonal().norm(), 1) +
                                            " px of each other, in an image of " + number(given.width_px) +
                                            " x " + number(given.height_px));
}

// Cameras that see a common view, and all that see known poses, belong together.
Verdict check_connected(const ViewsProblem& problem, std::span<const Chunk> chunks) {
  const std::size_t cameras = problem.cameras.size(), views = problem.views.size();
  if (cameras == 1) return {};
  std::vector<std::size_t> root(cameras + views + 1);  // the last: the known poses
  std::iota(root.begin(), root.end(), std::size_t{0});
  const auto root_of = [&root](std::size_t node) {
    while (root[node] != node) node = root[node];
    return node;
  };
  for (std::size_t v = 0; v < views; ++v)
    if (problem.views[v].X_WB) root[root_of(cameras + v)] = root_of(cameras + views);
  for (const Chunk& chunk : chunks)
    if (check_chunk(problem, chunk).status == Status::ok)
      root[root_of(cameras + chunk.view)] = root_of(chunk.camera);
  for (std::size_t c = 1; c < cameras; ++c)
    if (root_of(c) != root_of(0))
      return refused(Status::not_determined,
                     "camera " + quoted(problem.cameras[c].name) + " shares no view with camera " +
                         quoted(problem.cameras[0].name) + " or with cameras that do (a shared view needs " +
                         number(fewest_points) + " points in both)");
  return {};
}

}  // namespace

std::string name_of_chunk(const ViewsProblem& problem, const Chunk& chunk) {
  std::string name = "view " + quoted(problem.views[chunk.view].name);
  if (problem.cameras.size() > 1) name += " of camera " + quoted(problem.cameras[chunk.camera].name);
  return name;
}

BestPlane best_plane(std::span<const Vector3d> points) {
  const double count = static_cast<double>(points.size());
  Vector3d mean = Vector3d::Zero();
  for (const Vector3d& p : points) mean += p;
  mean /= count;
  Eigen::Matrix3d squares = Eigen::Matrix3d::Zero();
  for (const Vector3d& p : points) squares += (p - mean) * (p - mean).transpose();
  squares /= count;
  const SymmetricEigen eigen = symmetric_eigen(squares);
  const Vector3d normal = eigen.vectors.col(0), along = eigen.vectors.col(2);
  BestPlane plane;
  plane.X_GP.linear() << along, normal.cross(along), normal;
  plane.X_GP.translation() = mean;
  plane.spread = eigen.values.reverse().cwiseMax(0).cwiseSqrt();
  return plane;
}

Verdict check_problem(const ViewsProblem& problem) {
  if (problem.cameras.empty()) return refused(Status::wrong_problem, "there is no camera");
  if (problem.views.empty()) return refused(Status::too_few_points, "there are no views");
  const bool options = problem.sigma_px >= 0 && problem.reject_px >= 0 && problem.robust >= 0 &&
                       std::isfinite(problem.sigma_px + problem.reject_px + problem.robust);
  if (!options)
    return refused(Status::wrong_problem, "sigma_px, reject_px and robust must be finite and not below 0");
  for (const ViewsCamera& camera : problem.cameras)
    if (const Verdict verdict = check_camera(camera); verdict.status != Status::ok)
      return with_name(verdict, "camera " + quoted(camera.name));
  for (const BoardView& view : problem.views)
    if (const Verdict verdict = check_view(view); verdict.status != Status::ok)
      return with_name(verdict, "view " + quoted(view.name));
  for (std::size_t i = 0; i < problem.points.size(); ++i)
    if (Verdict verdict = check_point(problem, i); verdict.status != Status::ok) return verdict;
  if (problem.stage == StageAxes::estimate && !stage_of(problem))
    return refused(Status::wrong_problem,
                   "the stage's axes are to be estimated, but no two views have known poses that differ");
  return {};
}

std::vector<Chunk> chunks_of(const ViewsProblem& problem) {
  std::map<std::pair<std::size_t, std::size_t>, Chunk> chunks;
  for (std::size_t i = 0; i < problem.points.size(); ++i) {
    const ViewPoint& seen = problem.points[i];
    Chunk& chunk = chunks[{seen.view, seen.camera}];
    chunk.view = seen.view, chunk.camera = seen.camera;
    const Eigen::Matrix2d L = Eigen::LLT<Eigen::Matrix2d>(seen.point.covariance_px2).matrixL();
    Eigen::Matrix2d whiten;
    whiten << 1 / L(0, 0), 0, -L(1, 0) / (L(0, 0) * L(1, 1)), 1 / L(1, 1);
    chunk.points.push_back({seen.point.p_W_mm, seen.point.u_px, whiten, i});
  }
  std::vector<Chunk> list;
  for (auto& [place, chunk] : chunks) list.push_back(std::move(chunk));
  return list;
}

Verdict check_chunk(const ViewsProblem& problem, const Chunk& chunk) {
  const std::size_t different = different_points(chunk);
  if (different < fewest_points)
    return refused(Status::too_few_points, name_of_chunk(problem, chunk) + " has " + number(different) +
                                               " different points, at least " + number(fewest_points) +
                                               " are needed");
  const Vector3d on_board = best_plane(board_points(chunk)).spread,
                 in_image = best_plane(pixels(problem, chunk)).spread;
  if (!(on_board[1] > line * on_board[0]))
    return refused(Status::collinear, name_of_chunk(problem, chunk) + ": the points lie on a line");
  if (!(in_image[1] > line * in_image[0]))
    return refused(Status::collinear,
                   name_of_chunk(problem, chunk) + ": the pixels lie on a line (the board is seen edge-on)");
  return {};
}

Verdict check_chunks(const ViewsProblem& problem, std::span<const Chunk> chunks) {
  for (const Chunk& chunk : chunks)
    if (Verdict verdict = check_repeated(problem, chunk); verdict.status != Status::ok) return verdict;
  for (std::size_t c = 0; c < problem.cameras.size(); ++c)
    if (Verdict verdict = check_span(problem, c); verdict.status != Status::ok) return verdict;
  for (std::size_t v = 0; v < problem.views.size(); ++v) {
    Verdict best =
        refused(Status::too_few_points, "view " + quoted(problem.views[v].name) + " has no points");
    for (const Chunk& chunk : chunks)
      if (chunk.view == v && best.status != Status::ok) best = check_chunk(problem, chunk);
    if (best.status != Status::ok && !problem.views[v].X_WB) return best;
  }
  return check_connected(problem, chunks);
}

std::vector<Parameter> free_internals(const ViewsCamera& camera) {
  std::vector<Parameter> parameters{Parameter::fx, Parameter::fy, Parameter::cx, Parameter::cy};
  if (camera.lens == LensModel::division)
    parameters.push_back(Parameter::K);
  else
    parameters.insert(parameters.end(),
                      {Parameter::k1, Parameter::k2, Parameter::p1, Parameter::p2, Parameter::k3});
  ParameterSet fixed = camera.fixed;
  if (camera.one_focal && fixed.has(Parameter::fy)) fixed.add(Parameter::fx);
  if (camera.one_focal) fixed.add(Parameter::fy);  // goes with fx
  std::erase_if(parameters, [&fixed](Parameter parameter) { return fixed.has(parameter); });
  return parameters;
}

Eigen::MatrixXd directions_of(const ViewsCamera& camera) {
  const std::vector<Parameter> parameters = free_internals(camera);
  Eigen::MatrixXd directions =
      Eigen::MatrixXd::Zero(internals_count, static_cast<Eigen::Index>(parameters.size()));
  for (std::size_t k = 0; k < parameters.size(); ++k) {
    const auto column = static_cast<Eigen::Index>(k);
    // K stands where k1 does.
    const int place = parameters[k] == Parameter::K  ? 4
                      : parameters[k] < Parameter::K ? static_cast<int>(parameters[k])
                                                     : static_cast<int>(parameters[k]) - 1;
    directions(place, column) = 1;
    if (camera.one_focal && parameters[k] == Parameter::fx) directions(1, column) = 1;
  }
  return directions;
}

}  // namespace zeropose::bundle
