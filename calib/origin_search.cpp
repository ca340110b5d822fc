#include "calib/origin_search.h"

#include <cmath>
#include <limits>

#include "calib/linear_methods.h"
#include "calib/simplex.h"
#include "calib/words.h"

namespace zeropose {

double residual_sum_e1(std::span<const CalibrationPoint> points, const CameraModel& camera,
                       const Pose& X_WC) {
  const Pose X_CW = X_WC.inverse();
  double sum = 0;
  for (const CalibrationPoint& point : points) {
    const auto seen = ray(camera, point.u_px);
    const Eigen::Vector3d p_C = X_CW * point.p_W_mm;
    if (!seen || !(p_C.z() > 0)) return std::numeric_limits<double>::infinity();
    const Eigen::Vector2d apart = seen->head<2>() - p_C.head<2>() / p_C.z();
    sum += std::pow(camera.fx_px * apart.x(), 2) + std::pow(camera.fy_px * apart.y(), 2);
  }
  return sum;
}

OriginResult search_origin(const OriginProblem& problem, const PointLayout& layout) {
  const auto calibrated = [&](const Eigen::Vector2d& origin_px) {
    const LinearProblem linear{problem.points, origin_px, problem.aspect, {}, {}};
    return layout.coplanar ? calibrate_coplanar(linear, layout.X_WP) : calibrate_noncoplanar(linear);
  };
  OriginResult result;
  const LinearResult first = calibrated(problem.start_px);
  if (first.status != CalibrationStatus::ok) {
    result.status = first.status;
    result.reason = first.reason;
    return result;
  }
  SimplexProblem search;
  search.start = problem.start_px;
  search.step = problem.step_px;
  search.response = [&](const Eigen::Vector2d& origin_px) {
    const LinearResult at = calibrated(origin_px);
    if (at.status != CalibrationStatus::ok) return std::numeric_limits<double>::infinity();
    return residual_sum_e1(problem.points, at.model, at.X_WC);
  };
  const SimplexResult found = minimise(search);
  result.origin_px = found.best;
  result.evaluations = found.evaluations;
  result.rms_px = std::sqrt(found.response / static_cast<double>(problem.points.size()));
  result.status = found.converged && std::isfinite(found.response) ? CalibrationStatus::ok
                                                                   : CalibrationStatus::not_converged;
  if (result.status != CalibrationStatus::ok)
    result.reason =
        "the search for the image origin did not settle after " + number(found.evaluations) + " trials";
  return result;
}

}  // namespace zeropose
