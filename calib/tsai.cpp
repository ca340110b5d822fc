// C1 and C2: Tsai, A versatile camera calibration technique, IEEE J. Robotics and Automation 1987.
#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>

#include "calib/homography.h"
#include "calib/linear_methods.h"
#include "calib/linear_parts.h"
#include "calib/words.h"

namespace zeropose {
namespace {

using namespace linear;
using Eigen::Matrix2d;
using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector2d;
using Eigen::Vector3d;
using Eigen::VectorXd;

constexpr std::size_t coplanar_points = 5, noncoplanar_points = 7;
constexpr double least_depth_change = 0.002;  // over a board, relative: less is no perspective
constexpr double nearly_parallel_deg = 5;     // taken for parallel where the user gives the distance
constexpr double worst_focal_sigma = 0.5;     // of the focal length itself: it is not determined

// Pixels about the origin, and the points about their centroid in the frame that the method works in.
struct Pairs {
  std::vector<Vector2d> x_px;  // X' / aspect, Y'
  std::vector<Vector3d> p_mm;
  double pixel_scale = 1, point_scale = 1;
};

Pairs pairs_of(const LinearProblem& problem, const std::vector<Vector3d>& p_mm, double aspect) {
  Pairs pairs{{}, p_mm, 0, 0};
  for (const CalibrationPoint& point : problem.points) {
    Vector2d x = point.u_px - problem.origin_px;
    x.x() /= aspect;
    pairs.x_px.push_back(x);
    pairs.pixel_scale += x.squaredNorm();
  }
  for (const Vector3d& p : p_mm) pairs.point_scale += p.squaredNorm();
  pairs.pixel_scale = std::sqrt(pairs.pixel_scale / static_cast<double>(p_mm.size()));
  pairs.point_scale = std::sqrt(pairs.point_scale / static_cast<double>(p_mm.size()));
  return pairs;
}

// Y' (a1 . p + tx) = X' (a2 . p + ty): radial alignment. `dimensions` of p take part. The rows a1, tx and a2,
// ty up to one common factor.
struct Alignment {
  Vector3d a1 = Vector3d::Zero(), a2 = Vector3d::Zero();
  double tx = 0, ty = 0;
  double condition = 0;
};

Alignment align(const Pairs& pairs, Eigen::Index dimensions) {
  const Eigen::Index n = static_cast<Eigen::Index>(pairs.p_mm.size()), half = dimensions + 1;
  MatrixXd A(n, 2 * half);
  for (Eigen::Index i = 0; i < n; ++i) {
    const auto k = static_cast<std::size_t>(i);
    const Vector2d x = pairs.x_px[k] / pairs.pixel_scale;
    const VectorXd p = pairs.p_mm[k].head(dimensions) / pairs.point_scale;
    A.row(i) << x.y() * p.transpose(), x.y(), -x.x() * p.transpose(), -x.x();
  }
  const NullVector solution = null_vector(A);
  Alignment found;
  found.condition = solution.condition;
  found.a1.head(dimensions) = solution.x.head(dimensions);
  found.tx = solution.x(dimensions) * pairs.point_scale;
  found.a2.head(dimensions) = solution.x.segment(half, dimensions);
  found.ty = solution.x(2 * half - 1) * pairs.point_scale;
  return found;
}

// The camera looks at a point from the side on which it sees it; the farthest from the origin tells best.
void choose_sign(const Pairs& pairs, Alignment& alignment) {
  const auto farther = [](const Vector2d& a, const Vector2d& b) { return a.squaredNorm() < b.squaredNorm(); };
  const auto far = std::max_element(pairs.x_px.begin(), pairs.x_px.end(), farther);
  const Vector3d& p = pairs.p_mm[static_cast<std::size_t>(far - pairs.x_px.begin())];
  const Vector2d c(alignment.a1.dot(p) + alignment.tx, alignment.a2.dot(p) + alignment.ty);
  if (c.dot(*far) >= 0) return;
  alignment.a1 = -alignment.a1;
  alignment.a2 = -alignment.a2;
  alignment.tx = -alignment.tx;
  alignment.ty = -alignment.ty;
}

// Focal length, distortion and distance with rotation, tx and ty known: rows
// xc f + xc r2 Kf - X tz = X (r3 . p), Kf = K / f.
struct Depth {
  double f = 0, Kf = 0, tz = 0;
  double f_sigma = 0, condition = 0;
  double f_by_tz = 0, Kf_by_tz = 0;  // where only the ratios are determined
};

struct DepthRows {
  MatrixXd A;
  VectorXd b;
};

DepthRows depth_rows(const Pairs& pairs, const Matrix3d& R_CW, const Vector2d& t, double s) {
  const Eigen::Index n = static_cast<Eigen::Index>(pairs.p_mm.size());
  DepthRows rows{MatrixXd(2 * n, 3), VectorXd(2 * n)};
  for (Eigen::Index i = 0; i < n; ++i) {
    const Vector3d& p = pairs.p_mm[static_cast<std::size_t>(i)];
    const Vector2d& x = pairs.x_px[static_cast<std::size_t>(i)];
    const Vector3d c = R_CW * p;
    const double r2 = x.x() * x.x() / (s * s) + x.y() * x.y();  // of the pixel in units of fy
    const double xc = s * (c.x() + t.x()), yc = c.y() + t.y();
    rows.A.row(2 * i) << xc, xc * r2, -x.x();
    rows.A.row(2 * i + 1) << yc, yc * r2, -x.y();
    rows.b(2 * i) = x.x() * c.z();
    rows.b(2 * i + 1) = x.y() * c.z();
  }
  return rows;
}

Depth solve_depth(const DepthRows& rows) {
  const LeastSquares solution = least_squares(rows.A, rows.b);
  return {solution.x(0), solution.x(1), solution.x(2), solution.sigma(0), solution.condition, 0, 0};
}

// Parallel to the chip: xc (f/tz) + xc r2 (Kf/tz) = X.
Depth solve_ratios(const DepthRows& rows) {
  const LeastSquares solution = least_squares(rows.A.leftCols(2), -rows.A.col(2));
  Depth depth;
  depth.f_by_tz = solution.x(0);
  depth.Kf_by_tz = solution.x(1);
  depth.condition = solution.condition;
  return depth;
}

LinearResult result_of(const LinearProblem& problem, const Depth& depth, double s, const Pose& X_WC,
                       double condition) {
  LinearResult result;
  result.model.fx_px = s * depth.f;
  result.model.fy_px = depth.f;
  result.model.cx_px = problem.origin_px.x();
  result.model.cy_px = problem.origin_px.y();
  result.model.distortion = Division{depth.Kf * depth.f};
  result.X_WC = X_WC;
  result.condition = std::max(condition, depth.condition);
  if (!(depth.f > 0) || !X_WC.matrix().allFinite())
    return failure(CalibrationStatus::not_determined,
                   "the linear equations give the focal length " + number(depth.f) +
                       " px: are points and pixels in the same order, and u right, v down?",
                   condition);
  if (!all_in_front(problem.points, X_WC))
    return failure(CalibrationStatus::behind_camera,
                   "points lie on both sides of the camera that the linear equations give: wrong "
                   "coordinates or pixels",
                   condition);
  result.status = CalibrationStatus::ok;
  return result;
}

// --- C1

// The rotation whose upper left block is B (largest singular value 1), r3 >= 0 or r3 < 0.
Matrix3d rotation_from_block(const Matrix2d& B, double sign) {
  Matrix3d R = Matrix3d::Zero();
  R.topLeftCorner<2, 2>() = B;
  R(0, 2) = sign * std::sqrt(std::max(0.0, 1 - B.row(0).squaredNorm()));
  const double side = B.row(0).dot(B.row(1));
  R(1, 2) = (side > 0 ? -1 : 1) * sign * std::sqrt(std::max(0.0, 1 - B.row(1).squaredNorm()));
  R.row(2) = R.row(0).cross(R.row(1));
  return nearest_rotation(R);
}

double tilt_deg(const Matrix2d& B) {
  return std::acos(std::min(1.0, std::abs(B.determinant()))) * degrees_per_radian;
}

// How much the depth of the plane's points changes across them, relative: from the homography, which needs
// neither origin nor focal length. Infinite where there is no homography: then something else is wrong.
double depth_change(const Pairs& pairs) {
  std::vector<ImagedPoint> seen;
  for (std::size_t i = 0; i < pairs.p_mm.size(); ++i) seen.push_back({pairs.p_mm[i], pairs.x_px[i]});
  const auto H = homography(seen);
  if (!H) return std::numeric_limits<double>::infinity();
  double largest = 0;
  for (const Vector3d& p : pairs.p_mm)
    largest = std::max(largest, std::abs(H->row(2).head<2>().dot(p.head<2>())));
  return largest / std::abs((*H)(2, 2));
}

LinearResult parallel(const LinearProblem& problem, const Pairs& pairs, const Matrix2d& B, const Vector2d& t,
                      const Pose& X_WP) {
  Matrix3d flat = Matrix3d::Zero();
  flat.topLeftCorner<2, 2>() = B;
  flat(2, 2) = B.determinant() > 0 ? 1 : -1;
  const Matrix3d R = nearest_rotation(flat);
  Depth depth = solve_ratios(depth_rows(pairs, R, t, 1));
  if (!problem.tz_mm && !problem.fy_px)
    return failure(
        CalibrationStatus::parallel_to_chip,
        "the board is parallel to the chip (its depth changes by " + number(100 * depth_change(pairs), 3) +
            " % across it): focal length and distance cannot be told apart, only f / tz = " +
            number(depth.f_by_tz, 6) + " px/mm and K = " + number(depth.f_by_tz * depth.Kf_by_tz, 9) +
            " tz^2 / mm^2; tilt it by 20 deg or more, or give its distance tz",
        depth.condition);
  depth.tz = problem.tz_mm ? *problem.tz_mm : *problem.fy_px / depth.f_by_tz;
  depth.f = depth.f_by_tz * depth.tz;
  depth.Kf = depth.Kf_by_tz * depth.tz;
  const Pose X_PC = pose_from(R, Vector3d(t.x(), t.y(), depth.tz), Vector3d::Zero());
  return result_of(problem, depth, problem.aspect, X_WP * X_PC, depth.condition);
}

}  // namespace

LinearResult calibrate_coplanar(const LinearProblem& problem, const Pose& X_WP) {
  if (problem.points.size() < coplanar_points)
    return failure(CalibrationStatus::too_few_points, number(problem.points.size()) +
                                                          " points in a plane, at least " +
                                                          number(coplanar_points) + " are needed");
  const Pose X_PW = X_WP.inverse();
  std::vector<Vector3d> p_P;
  for (const CalibrationPoint& point : problem.points) p_P.push_back(X_PW * point.p_W_mm);
  const Pairs pairs = pairs_of(problem, p_P, problem.aspect);
  Alignment alignment = align(pairs, 2);
  if (!(alignment.condition < largest_condition))
    return failure(CalibrationStatus::collinear, "the points of the plane lie on a line or a conic",
                   alignment.condition);
  choose_sign(pairs, alignment);
  Matrix2d B;
  B << alignment.a1.head<2>().transpose(), alignment.a2.head<2>().transpose();
  // The largest singular value of the block is 1: spec 30 C1 step 2.
  const double size = 0.5 * (std::hypot(B(0, 0) + B(1, 1), B(0, 1) - B(1, 0)) +
                             std::hypot(B(0, 0) - B(1, 1), B(0, 1) + B(1, 0)));
  B /= size;
  const Vector2d t = Vector2d(alignment.tx, alignment.ty) / size;
  const bool flat = depth_change(pairs) < least_depth_change;
  if (flat || (problem.tz_mm && tilt_deg(B) < nearly_parallel_deg))
    return parallel(problem, pairs, B, t, X_WP);
  Matrix3d R = rotation_from_block(B, 1);
  Depth depth = solve_depth(depth_rows(pairs, R, t, 1));
  if (depth.f < 0) {
    R = rotation_from_block(B, -1);
    depth = solve_depth(depth_rows(pairs, R, t, 1));
  }
  if (!(depth.f_sigma < worst_focal_sigma * std::abs(depth.f))) return parallel(problem, pairs, B, t, X_WP);
  const Pose X_PC = pose_from(R, Vector3d(t.x(), t.y(), depth.tz), Vector3d::Zero());
  return result_of(problem, depth, problem.aspect, X_WP * X_PC, alignment.condition);
}

LinearResult calibrate_noncoplanar(const LinearProblem& problem) {
  if (problem.points.size() < noncoplanar_points)
    return failure(CalibrationStatus::too_few_points, number(problem.points.size()) +
                                                          " points with depth, at least " +
                                                          number(noncoplanar_points) + " are needed");
  const Centred body = centred(problem.points);
  const Pairs pairs = pairs_of(problem, body.p_mm, 1);
  Alignment alignment = align(pairs, 3);
  if (!(alignment.condition < largest_condition))
    return failure(
        CalibrationStatus::coplanar,
        "the points, or all but one of them, lie in one plane: there is no depth to calibrate from",
        alignment.condition);
  choose_sign(pairs, alignment);
  const double size = alignment.a2.norm(), s = alignment.a1.norm() / size;
  Matrix3d R;
  R.row(0) = alignment.a1 / (size * s);
  R.row(1) = alignment.a2 / size;
  R.row(2) = R.row(0).cross(R.row(1));
  R = nearest_rotation(R);
  const Vector2d t(alignment.tx / (size * s), alignment.ty / size);
  const Depth depth = solve_depth(depth_rows(pairs, R, t, s));
  const Pose X_WC = pose_from(R, Vector3d(t.x(), t.y(), depth.tz), body.centroid_mm);
  if (!(depth.condition < largest_condition))
    return failure(CalibrationStatus::not_determined,
                   "focal length and distance cannot be told apart: the points have no depth along the "
                   "camera's axis",
                   depth.condition);
  return result_of(problem, depth, s, X_WC, alignment.condition);
}

}  // namespace zeropose
