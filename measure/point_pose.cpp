#include "measure/point_pose.h"

#include "calib/best_fit.h"
#include "calib/words.h"
#include "measure/small_cholesky.h"

namespace zeropose {
namespace {

PointPose failed(Code code, std::string reason) {
  PointPose result;
  result.code = code;
  result.reason = std::move(reason);
  return result;
}

// A point moves by dt + w x (R p_O).
Matrix6 covariance_of(std::span<const MeasuredPoint> points, std::span<const PointPair> pairs,
                      const Pose& X_AO) {
  Matrix6 N = Matrix6::Zero(), M = Matrix6::Zero();
  for (std::size_t i = 0; i < points.size(); ++i) {
    Eigen::Matrix<double, 3, 6> J;
    J << Eigen::Matrix3d::Identity(), -cross_matrix(X_AO.linear() * points[i].p_O_mm);
    const double weight = pairs[i].weight;
    N += weight * J.transpose() * J;
    M += weight * weight * J.transpose() * points[i].covariance_mm2 * J;
  }
  const Matrix6 inverse = SmallCholesky<6>(N).inverse();
  return inverse * M * inverse;
}

}  // namespace

PointPose pose_of_points(std::span<const MeasuredPoint> points) {
  std::vector<PointPair> pairs;
  for (const MeasuredPoint& point : points) {
    const Eigen::Matrix3d& C = point.covariance_mm2;
    if (!point.p_A_mm.allFinite() || !point.p_O_mm.allFinite() || !C.allFinite() || !SmallCholesky<3>(C).ok())
      return failed(Code::marks_invalid, "point " + number(pairs.size() + 1) +
                                             " (from 1) has a number or a covariance that cannot be used");
    pairs.push_back({point.p_A_mm, point.p_O_mm, 3 / C.trace()});
  }
  if (pairs.size() < 3)
    return failed(Code::too_few_marks, number(pairs.size()) + " points were measured, a pose needs 3");
  BestFitResult fit = best_fit(pairs);
  if (fit.status != BestFitStatus::ok)
    return failed(Code::geometry_degenerate, "the points lie on a line: the rotation about it is open");
  PointPose result;
  result.code = Code::ok;
  result.X_AO = fit.X_AB;
  result.covariance = covariance_of(points, pairs, fit.X_AB);
  result.deviations_mm = std::move(fit.residuals_mm);
  return result;
}

}  // namespace zeropose
