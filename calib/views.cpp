#include "calib/views.h"

#include <algorithm>
#include <cmath>

#include "calib/eccentricity.h"
#include "calib/views_bundle.h"
#include "calib/views_checks.h"
#include "calib/views_report.h"
#include "calib/views_start.h"
#include "calib/words.h"

namespace zeropose {
namespace {

using namespace bundle;
using Status = CalibrationStatus;

constexpr int disc_rounds = 10;
constexpr double disc_settled_px = 1e-6;
constexpr int mirror_rounds = 3;
constexpr double at_once = 0.5;  // deviations above this part of the worst are thrown out together with it

ViewsResult failure(const Verdict& verdict) {
  ViewsResult result;
  result.status = verdict.status, result.reason = verdict.reason;
  return result;
}

// The first camera is the frame W unless known poses say what W is.
Freedom freedom_of(const ViewsProblem& problem) {
  Freedom freedom;
  bool any_known = false;
  for (const BoardView& view : problem.views) {
    freedom.views.push_back(!view.X_WB.has_value());
    any_known = any_known || view.X_WB.has_value();
  }
  freedom.cameras.assign(problem.cameras.size(), true);
  freedom.cameras.front() = any_known;
  for (const ViewsCamera& camera : problem.cameras) freedom.internals.push_back(directions_of(camera));
  if (problem.stage == StageAxes::estimate) freedom.stage = stage_of(problem);
  return freedom;
}

Verdict check_redundancy(std::span<const Chunk> chunks, const Freedom& freedom) {
  std::size_t equations = 0, unknowns = 0;
  for (const Chunk& chunk : chunks) equations += 2 * chunk.points.size();
  for (const Eigen::MatrixXd& directions : freedom.internals)
    unknowns += static_cast<std::size_t>(directions.cols());
  unknowns += 6 * static_cast<std::size_t>(std::ranges::count(freedom.cameras, true) +
                                           std::ranges::count(freedom.views, true));
  if (freedom.stage) unknowns += static_cast<std::size_t>(freedom.stage->directions.cols());
  if (equations > unknowns) return {};
  return refused(Status::too_few_points, number(equations) + " equations (two per point) for " +
                                             number(unknowns) + " unknowns: more points or views are needed");
}

// A calibration under way.
struct Calibration {
  const ViewsProblem& problem;
  std::vector<Chunk> chunks;
  Freedom freedom;
  State state;
  Outcome last;
  int iterations = 0;

  // Takes the eccentricity of discs, which depends on the estimate, off their pixels; the largest change.
  double correct_discs() {
    double largest = 0;
    for (Chunk& chunk : chunks) {
      const CameraModel& model = state.models[chunk.camera];
      const Pose X_CB = state.X_WC[chunk.camera].inverse() * state.X_WB[chunk.view];
      for (SeenPoint& point : chunk.points) {
        const CalibrationPoint& given = problem.points[point.index].point;
        if (!(given.disc_radius_mm > 0)) continue;
        const Eigen::Vector2d corrected =
            given.u_px - ellipse_centre_offset(model, X_CB * given.p_W_mm,
                                               X_CB.linear() * given.disc_normal_W, given.disc_radius_mm);
        largest = std::max(largest, (corrected - point.u_px).norm());
        point.u_px = corrected;
      }
    }
    return largest;
  }

  void refine_once() {
    Options options{problem.robust, problem.max_iterations, {}};
    if (problem.progress)
      options.progress = [this](int iteration, double cost) {
        problem.progress(iterations + iteration, cost);
      };
    last = refine(state, chunks, freedom, options);
    iterations += last.iterations;
  }

  void settle() {
    for (int round = 0; round < disc_rounds; ++round) {
      refine_once();
      if (!last.usable || correct_discs() < disc_settled_px) return;
    }
  }

  void settle_the_right_way_round() {
    for (int round = 0; round < mirror_rounds; ++round) {
      settle();
      if (!last.usable || !turn_mirrored_views(problem, state, chunks, problem.robust)) return;
    }
    settle();
  }
};

double deviation_px(const Calibration& calibration, const SeenPoint& point) {
  const auto deviation = deviation_of(calibration.state, calibration.problem.points[point.index]);
  return deviation ? deviation->dev_px.norm() : std::numeric_limits<double>::infinity();
}

// Throws out the worst and those nearly as bad; smaller ones may be its doing.
std::vector<std::size_t> throw_out_worst(Calibration& calibration) {
  std::vector<std::pair<double, std::size_t>> bad;
  for (const Chunk& chunk : calibration.chunks)
    for (const SeenPoint& point : chunk.points) {
      const double deviation = deviation_px(calibration, point);
      if (deviation > calibration.problem.reject_px) bad.emplace_back(deviation, point.index);
    }
  std::ranges::sort(bad, std::greater());
  std::vector<std::size_t> thrown;
  for (const auto& [deviation, index] : bad)
    if (deviation >= at_once * bad.front().first) thrown.push_back(index);
  for (Chunk& chunk : calibration.chunks)
    std::erase_if(chunk.points, [&thrown](const SeenPoint& point) {
      return std::ranges::find(thrown, point.index) != thrown.end();
    });
  std::erase_if(calibration.chunks, [](const Chunk& chunk) { return chunk.points.empty(); });
  return thrown;
}

Verdict reject(Calibration& calibration, std::vector<std::size_t>& rejected) {
  while (calibration.problem.reject_px > 0 && calibration.last.usable) {
    const std::vector<std::size_t> thrown = throw_out_worst(calibration);
    if (thrown.empty()) return {};
    rejected.insert(rejected.end(), thrown.begin(), thrown.end());
    Verdict verdict = check_chunks(calibration.problem, calibration.chunks);
    if (verdict.status == Status::ok) verdict = check_redundancy(calibration.chunks, calibration.freedom);
    if (verdict.status != Status::ok) {
      verdict.reason = "after " + number(rejected.size()) + " points deviated by more than " +
                       number(calibration.problem.reject_px) + " px and were thrown out: " + verdict.reason;
      return verdict;
    }
    calibration.settle_the_right_way_round();
  }
  return {};
}

ViewsResult result_of(const Calibration& calibration, const std::vector<std::size_t>& rejected) {
  if (!calibration.last.usable)
    return failure(refused(Status::behind_camera, "no start puts all points in front of the camera"));
  ViewsResult result =
      report_of(calibration.problem, calibration.state, calibration.chunks, calibration.freedom);
  if (result.status == Status::ok && !calibration.last.converged)
    return failure(refused(Status::not_converged,
                           "not settled after " + number(calibration.iterations) + " iterations"));
  result.rejected = rejected;
  result.iterations = calibration.iterations;
  if (!rejected.empty())
    result.diagnosis.warnings.push_back(number(rejected.size()) + " of " +
                                        number(calibration.problem.points.size()) + " points thrown out");
  return result;
}

}  // namespace

ViewsResult calibrate_views(const ViewsProblem& problem) {
  if (const Verdict verdict = check_problem(problem); verdict.status != Status::ok) return failure(verdict);
  Calibration calibration{problem, chunks_of(problem), freedom_of(problem), {}, {}, 0};
  if (const Verdict verdict = check_chunks(problem, calibration.chunks); verdict.status != Status::ok)
    return failure(verdict);
  if (const Verdict verdict = check_redundancy(calibration.chunks, calibration.freedom);
      verdict.status != Status::ok)
    return failure(verdict);
  const Start start = start_of(problem, calibration.chunks, calibration.freedom);
  if (start.verdict.status != Status::ok) return failure(start.verdict);
  calibration.state = start.state;
  calibration.settle_the_right_way_round();
  std::vector<std::size_t> rejected;
  if (const Verdict verdict = reject(calibration, rejected); verdict.status != Status::ok)
    return failure(verdict);
  return result_of(calibration, rejected);
}

}  // namespace zeropose
