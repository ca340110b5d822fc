// C3: direct linear transformation; Hartley's scaling.
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "calib/linear_methods.h"
#include "calib/linear_parts.h"
#include "calib/words.h"

namespace zeropose {
namespace {

using namespace linear;
using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector2d;
using Eigen::Vector3d;
using Eigen::VectorXd;
using Matrix34 = Eigen::Matrix<double, 3, 4>;

constexpr std::size_t linear_points = 6;

struct PixelScale {
  Vector2d mean_px = Vector2d::Zero();
  double scale_px = 1;
};

PixelScale pixel_scale_of(std::span<const CalibrationPoint> points) {
  PixelScale result;
  for (const CalibrationPoint& point : points) result.mean_px += point.u_px;
  result.mean_px /= static_cast<double>(points.size());
  double sum = 0;
  for (const CalibrationPoint& point : points) sum += (point.u_px - result.mean_px).squaredNorm();
  result.scale_px = std::sqrt(sum / static_cast<double>(points.size()));
  return result;
}

MatrixXd rows_of(std::span<const CalibrationPoint> points, const Centred& body, const PixelScale& pixels) {
  const Eigen::Index n = static_cast<Eigen::Index>(points.size());
  MatrixXd A = MatrixXd::Zero(2 * n, 12);
  for (Eigen::Index i = 0; i < n; ++i) {
    const auto k = static_cast<std::size_t>(i);
    const Vector2d u = (points[k].u_px - pixels.mean_px) / pixels.scale_px;
    const Eigen::RowVector4d p =
        (Eigen::RowVector4d() << body.p_mm[k].transpose() / body.scale_mm, 1).finished();
    A.row(2 * i).segment<4>(0) = p;
    A.row(2 * i).segment<4>(8) = -u.x() * p;
    A.row(2 * i + 1).segment<4>(4) = p;
    A.row(2 * i + 1).segment<4>(8) = -u.y() * p;
  }
  return A;
}

// The 3x4 projection from pixels and centred points, scaled so that its third row's rotation has length 1 and
// the mean depth is positive.
Matrix34 projection_of(const VectorXd& x, const Centred& body, const PixelScale& pixels) {
  Matrix34 P;
  P << x.segment<4>(0).transpose(), x.segment<4>(4).transpose(), x.segment<4>(8).transpose();
  P.leftCols<3>() /= body.scale_mm;
  P.topRows<2>() = pixels.scale_px * P.topRows<2>() + pixels.mean_px * P.row(2);
  P /= P.row(2).head<3>().norm();
  return P(2, 3) < 0 ? Matrix34(-P) : P;
}

// With rotation and tz fixed the pixel is linear in f, f t and C: u zc = fx (r1 . p) + fx tx + cx zc.
struct Axis {
  double f = 0, t = 0, c = 0;
};

Axis estimate_axis(std::span<const CalibrationPoint> points, const Centred& body, const Matrix3d& R,
                   double tz, Eigen::Index axis) {
  const Eigen::Index n = static_cast<Eigen::Index>(points.size());
  MatrixXd A(n, 3);
  VectorXd b(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    const auto k = static_cast<std::size_t>(i);
    const double zc = R.row(2).dot(body.p_mm[k]) + tz;
    A.row(i) << R.row(axis).dot(body.p_mm[k]) / zc, 1 / zc, 1;
    b(i) = points[k].u_px(axis);
  }
  const LeastSquares solution = least_squares(A, b);
  return {solution.x(0), solution.x(1) / solution.x(0), solution.x(2)};
}

}  // namespace

LinearResult calibrate_linear(const LinearProblem& problem) {
  if (problem.points.size() < linear_points)
    return failure(CalibrationStatus::too_few_points, number(problem.points.size()) +
                                                          " points with depth, at least " +
                                                          number(linear_points) + " are needed");
  const Centred body = centred(problem.points);
  const PixelScale pixels = pixel_scale_of(problem.points);
  const NullVector solution = null_vector(rows_of(problem.points, body, pixels));
  if (!(solution.condition < largest_condition))
    return failure(
        CalibrationStatus::coplanar,
        "the points, or all but one of them, lie in one plane: there is no depth to calibrate from",
        solution.condition);
  const Matrix34 P = projection_of(solution.x, body, pixels);
  const Vector3d m1 = P.row(0).head<3>(), m2 = P.row(1).head<3>(), m3 = P.row(2).head<3>();
  Matrix3d R;
  R.row(0) = (m1 - m1.dot(m3) * m3).normalized();
  R.row(1) = (m2 - m2.dot(m3) * m3).normalized();
  R.row(2) = m3;
  // A mirror image: the table's axes are left-handed, or u and v are exchanged.
  if (!(R.determinant() > 0))
    return failure(CalibrationStatus::behind_camera,
                   "the points form a mirror image of the picture: is u right and v down, and are the "
                   "coordinates right-handed?",
                   solution.condition);
  R = nearest_rotation(R);
  const Axis u = estimate_axis(problem.points, body, R, P(2, 3), 0);
  const Axis v = estimate_axis(problem.points, body, R, P(2, 3), 1);
  LinearResult result;
  result.condition = solution.condition;
  result.model.fx_px = u.f;
  result.model.fy_px = v.f;
  result.model.cx_px = u.c;
  result.model.cy_px = v.c;
  result.X_WC = pose_from(R, Vector3d(u.t, v.t, P(2, 3)), body.centroid_mm);
  if (!(u.f > 0) || !(v.f > 0) || !all_in_front(problem.points, result.X_WC))
    return failure(CalibrationStatus::behind_camera,
                   "points lie on both sides of the camera that the linear equations give: wrong "
                   "coordinates or pixels",
                   solution.condition);
  result.status = CalibrationStatus::ok;
  return result;
}

}  // namespace zeropose
