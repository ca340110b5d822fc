// C3: direct linear transformation.
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <optional>
#include <vector>

#include "calib/homography.h"
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

// From the world to pixels, scaled so that its third row's rotation has length 1 and the mean depth is
// positive. nullopt: the points have no depth.
std::optional<Matrix34> scaled_projection(std::span<const CalibrationPoint> points, const Centred& body) {
  std::vector<ImagedPoint> seen;
  for (std::size_t i = 0; i < points.size(); ++i) seen.push_back({body.p_mm[i], points[i].u_px});
  auto P = projection_matrix(seen);
  if (!P) return std::nullopt;
  *P /= P->row(2).head<3>().norm();
  if ((*P)(2, 3) < 0) *P = -*P;
  return P;
}

// With rotation and tz fixed the pixel is linear in f, f t and C: u zc = fx (r1 . p) + fx tx + cx zc.
struct Axis {
  double f = 0, t = 0, c = 0;
  double condition = 0;
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
  return {solution.x(0), solution.x(1) / solution.x(0), solution.x(2), solution.condition};
}

}  // namespace

LinearResult calibrate_linear(const LinearProblem& problem) {
  if (problem.points.size() < linear_points)
    return failure(CalibrationStatus::too_few_points, number(problem.points.size()) +
                                                          " points with depth, at least " +
                                                          number(linear_points) + " are needed");
  const Centred body = centred(problem.points);
  const auto projection = scaled_projection(problem.points, body);
  if (!projection)
    return failure(
        CalibrationStatus::coplanar,
        "the points, or all but one of them, lie in one plane: there is no depth to calibrate from");
  const Matrix34& P = *projection;
  const Vector3d m1 = P.row(0).head<3>(), m2 = P.row(1).head<3>(), m3 = P.row(2).head<3>();
  Matrix3d R;
  R.row(0) = (m1 - m1.dot(m3) * m3).normalized();
  R.row(1) = (m2 - m2.dot(m3) * m3).normalized();
  R.row(2) = m3;
  // A mirror image: the table's axes are left-handed, or u and v are exchanged.
  if (!(R.determinant() > 0))
    return failure(CalibrationStatus::behind_camera,
                   "the points form a mirror image of the picture: is u right and v down, and are the "
                   "coordinates right-handed?");
  R = nearest_rotation(R);
  const Axis u = estimate_axis(problem.points, body, R, P(2, 3), 0);
  const Axis v = estimate_axis(problem.points, body, R, P(2, 3), 1);
  LinearResult result;
  result.condition = std::max(u.condition, v.condition);
  result.model.fx_px = u.f;
  result.model.fy_px = v.f;
  result.model.cx_px = u.c;
  result.model.cy_px = v.c;
  result.X_WC = pose_from(R, Vector3d(u.t, v.t, P(2, 3)), body.centroid_mm);
  if (!(u.f > 0) || !(v.f > 0) || !all_in_front(problem.points, result.X_WC))
    return failure(CalibrationStatus::behind_camera,
                   "points lie on both sides of the camera that the linear equations give: wrong "
                   "coordinates or pixels",
                   result.condition);
  result.status = CalibrationStatus::ok;
  return result;
}

}  // namespace zeropose
