#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <limits>

#include "calib/eccentricity.h"
#include "calib/hand_eye_parts.h"
#include "calib/pose_only.h"
#include "calib/words.h"

namespace zeropose::hand_eye {
namespace {

// The pixels of flat discs as if their centres had been seen, from where the board is about.
std::vector<CalibrationPoint> without_eccentricity(const CameraModel& model, const Pose& X_CB,
                                                   std::vector<CalibrationPoint> points) {
  for (CalibrationPoint& point : points)
    point.u_px -= ellipse_centre_offset(model, X_CB * point.p_W_mm, X_CB.linear() * point.disc_normal_W,
                                        point.disc_radius_mm);
  return points;
}

PoseOnlyResult pose_of_view(const HandEyeProblem& problem, const std::vector<CalibrationPoint>& points,
                            const std::optional<Pose>& X_BC_near) {
  PoseOnlyProblem alone;
  alone.model = problem.model;
  alone.points = points;
  alone.sigma_px = problem.sigma_px;
  alone.X_WC_near = X_BC_near;
  return calibrate_pose(alone);
}

std::vector<bundle::SeenPoint> used_points(const std::vector<CalibrationPoint>& points,
                                           const PoseOnlyResult& result) {
  std::vector<bundle::SeenPoint> seen;
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (!result.deviations[i].used) continue;
    const Eigen::Matrix2d L = points[i].covariance_px2.llt().matrixL();
    seen.push_back({points[i].p_W_mm, points[i].u_px, L.inverse(), i});
  }
  return seen;
}

}  // namespace

std::optional<SeenView> look(const HandEyeProblem& problem, std::size_t view,
                             const std::optional<Pose>& X_CB_near, HandEyeViewResult& result) {
  const HandEyeView& given = problem.views[view];
  const auto refuse = [&](std::string reason) {
    result.reason = std::move(reason);
    result.error_mm = result.error_deg = std::numeric_limits<double>::infinity();
    return std::nullopt;
  };
  std::optional<Pose> X_BC_near;
  if (X_CB_near) X_BC_near = X_CB_near->inverse();
  std::vector<CalibrationPoint> points = given.points;
  PoseOnlyResult alone = pose_of_view(problem, points, X_BC_near);
  const bool discs = std::ranges::any_of(points, [](const auto& point) { return point.disc_radius_mm > 0; });
  // Twice: the offset hardly depends on where the board is.
  for (int round = 0; round < 2 && discs && alone.status == PoseOnlyStatus::ok; ++round) {
    points = without_eccentricity(problem.model, alone.X_WC.inverse(), given.points);
    alone = pose_of_view(problem, points, X_BC_near);
  }
  if (alone.status != PoseOnlyStatus::ok) return refuse(alone.reason);
  SeenView seen;
  seen.index = view;
  seen.X_RH = given.X_RH;
  seen.X_CB = alone.X_WC.inverse();
  seen.points = used_points(points, alone);
  const auto equations = bundle::equations_of(problem.model, seen.X_CB, seen.points, 0);
  if (!equations) return refuse("the board's points have no image at the pose that was found");
  seen.cofactor =
      equations->sums.block<6, 6>(internals_count, internals_count).ldlt().solve(Matrix6::Identity());
  seen.cost = equations->cost;
  for (const auto& deviation : alone.deviations)
    if (deviation.used) seen.squares_px2 += deviation.dev_px.squaredNorm();
  result.X_CB = seen.X_CB;
  result.points_used = seen.points.size();
  result.points_removed = alone.removed;
  return seen;
}

}  // namespace zeropose::hand_eye
