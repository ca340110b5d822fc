#include "calib/measured_frame.h"

#include <Eigen/LU>
#include <cmath>

#include "calib/words.h"

namespace zeropose {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

// Shorter by so much than the layout is long, a direction is none.
constexpr double least_share = 1e-3;
constexpr int most_rounds = 50;
constexpr double small_step = 1e-10;  // mm and rad

MeasuredFrame failed(MeasuredFrameStatus status, std::string reason) {
  MeasuredFrame result;
  result.status = status;
  result.reason = std::move(reason);
  return result;
}

// The first coordinate that the role determines: all three, y and z, or z.
int first_of(FrameRole role) { return static_cast<int>(role); }

Vector3d mean_of(std::span<const FramePoint> points, FrameRole role) {
  Vector3d sum = Vector3d::Zero();
  double count = 0;
  for (const FramePoint& point : points)
    if (point.role == role) sum += point.p_T_mm, ++count;
  return sum / count;
}

double length_of(std::span<const FramePoint> points) {
  double longest = 0;
  for (const FramePoint& point : points)
    longest = std::max(longest, (point.p_T_mm - points.front().p_T_mm).norm());
  return longest;
}

// failed: nothing is wrong.
MeasuredFrame fault_of(std::span<const FramePoint> points) {
  int counts[3] = {0, 0, 0};
  for (const FramePoint& point : points) {
    if (!point.p_T_mm.allFinite())
      return failed(MeasuredFrameStatus::wrong_problem, "point " + point.name + " has a number that is none");
    ++counts[first_of(point.role)];
  }
  const char* const names[] = {"the origin", "the x axis", "the xy plane"};
  for (int role = 0; role < 3; ++role)
    if (counts[role] == 0)
      return failed(MeasuredFrameStatus::too_few_points,
                    std::string("no point for ") + names[role] +
                        ": a frame needs one for the origin, one on the x axis and one in the xy plane");
  return {};
}

// The 3-2-1 rule with the means of the roles.
MeasuredFrame start_of(std::span<const FramePoint> points) {
  const Vector3d origin = mean_of(points, FrameRole::origin);
  const Vector3d along = mean_of(points, FrameRole::x_axis) - origin;
  const double least = least_share * length_of(points);
  if (!(along.norm() > least))
    return failed(MeasuredFrameStatus::no_direction, "the points of the x axis are " +
                                                         number(along.norm(), 3) +
                                                         " mm from the origin: they give no direction");
  const Vector3d x = along.normalized(), off = mean_of(points, FrameRole::xy_plane) - origin;
  const Vector3d across = off - off.dot(x) * x;
  if (!(across.norm() > least))
    return failed(MeasuredFrameStatus::no_direction, "the points of the xy plane are " +
                                                         number(across.norm(), 3) +
                                                         " mm from the x axis: the turn about it is free");
  MeasuredFrame result;
  result.X_TW.linear() << x, across.normalized(), x.cross(across.normalized());
  result.X_TW.translation() = origin;
  return result;
}

struct Equations {
  Matrix6 N = Matrix6::Zero();
  Vector6 g = Vector6::Zero();
  double squares = 0;
  int rows = 0;
};

// A point's place in W by the delta of X_TW: -R^T dt + R^T [p - t]x dr.
Equations equations_at(std::span<const FramePoint> points, const Pose& X_TW) {
  Equations equations;
  const Matrix3d R_WT = X_TW.linear().transpose();
  for (const FramePoint& point : points) {
    const Vector3d arm = point.p_T_mm - X_TW.translation(), p_W = R_WT * arm;
    Eigen::Matrix<double, 3, 6> J;
    J << -R_WT, R_WT * cross_matrix(arm);
    for (int axis = first_of(point.role); axis < 3; ++axis) {
      equations.N += J.row(axis).transpose() * J.row(axis);
      equations.g -= J.row(axis).transpose() * p_W(axis);
      equations.squares += p_W(axis) * p_W(axis);
      ++equations.rows;
    }
  }
  return equations;
}

}  // namespace

MeasuredFrame measured_frame(std::span<const FramePoint> points, double sigma_mm) {
  if (MeasuredFrame fault = fault_of(points); fault.status != MeasuredFrameStatus::failed) return fault;
  MeasuredFrame result = start_of(points);
  if (result.status != MeasuredFrameStatus::failed) return result;
  for (int round = 0;; ++round) {
    const Equations at = equations_at(points, result.X_TW);
    const Vector6 delta = at.N.fullPivLu().solve(at.g);
    if (round == most_rounds || !delta.allFinite())
      return failed(MeasuredFrameStatus::not_converged, "no frame fits the points");
    result.X_TW = moved(result.X_TW, delta);
    if (delta.norm() < small_step) break;
  }
  const Equations at = equations_at(points, result.X_TW);
  result.redundancy = at.rows - 6;
  result.sigma_mm =
      sigma_mm > 0 || result.redundancy <= 0 ? sigma_mm : std::sqrt(at.squares / result.redundancy);
  result.covariance = result.sigma_mm * result.sigma_mm * at.N.inverse();
  for (const FramePoint& point : points) {
    Vector3d p_W = result.X_TW.inverse() * point.p_T_mm;
    if (point.role == FrameRole::x_axis && !(p_W.x() > 0))
      return failed(MeasuredFrameStatus::wrong_side, "point " + point.name + " of the x axis lies at x = " +
                                                         number(p_W.x()) + " mm, on its negative side");
    p_W.head(first_of(point.role)).setZero();
    result.residuals_W_mm.push_back(p_W);
  }
  result.status = MeasuredFrameStatus::ok;
  return result;
}

}  // namespace zeropose
