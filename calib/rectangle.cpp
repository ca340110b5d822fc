#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "calib/vanishing.h"

namespace zeropose {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

// Farther than this many sizes of the rectangle's image is at infinity: rounding alone moves such a point
// without bound, and no camera measures corners so well.
constexpr double infinity_in_sizes = 1e5;
// A triangle of three corners below this share of the square of the longest side is a line.
constexpr double flat_ratio = 1e-6;

double turn(const Vector2d& a, const Vector2d& b, const Vector2d& c) {
  return (b - a).x() * (c - b).y() - (b - a).y() * (c - b).x();
}

double size_of(const RectangleCorners& corners) {
  return std::max((corners[2] - corners[0]).norm(), (corners[3] - corners[1]).norm());
}

// Any view of a rectangle from the front is convex with the corners in order.
std::string mistake_of(const RectangleCorners& corners) {
  for (const Vector2d& corner : corners)
    if (!corner.allFinite()) return "a corner is not finite";
  const double least = flat_ratio * size_of(corners) * size_of(corners);
  int left = 0, right = 0;
  for (std::size_t i = 0; i < 4; ++i) {
    const double area = turn(corners[i], corners[(i + 1) % 4], corners[(i + 2) % 4]);
    if (!(std::abs(area) > least)) return "three corners lie on a line";
    ++(area > 0 ? left : right);
  }
  return left * right == 0 ? "" : "the corners are not those of a rectangle in the order A B C D around it";
}

using Rays = Eigen::Matrix<double, 3, 4>;

Rays corners_mm(const RectangleSize& size) {
  const double x = size.side_mm, y = size.ratio * size.side_mm;
  return (Rays() << 0, x, x, 0, 0, 0, y, y, 0, 0, 0, 0).finished();
}

// The translation that brings the turned corners nearest to their rays.
Vector3d nearest_to_rays(const Rays& rays, const Rays& turned_mm) {
  Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
  Vector3d right = Vector3d::Zero();
  for (int i = 0; i < 4; ++i) {
    const Vector3d d = rays.col(i).normalized();
    const Eigen::Matrix3d across = Eigen::Matrix3d::Identity() - d * d.transpose();
    sum += across;
    right -= across * turned_mm.col(i);
  }
  return sum.inverse() * right;
}

std::optional<double> corner_rms_px(const CameraModel& camera, const RectangleCorners& corners_px,
                                    const Rays& corners_C_mm) {
  double sum = 0;
  for (int i = 0; i < 4; ++i) {
    const auto u_px = project(camera, corners_C_mm.col(i));
    if (!u_px) return std::nullopt;
    sum += (*u_px - corners_px[static_cast<std::size_t>(i)]).squaredNorm();
  }
  return std::sqrt(sum / 4);
}

RectanglePose refused(RectanglePose result, std::string reason) {
  result.reason = std::move(reason);
  return result;
}

Vector3d line(const Vector2d& a, const Vector2d& b) { return a.homogeneous().cross(b.homogeneous()); }

}  // namespace

RectanglePair vanishing_pair(const RectangleCorners& corners_px, bool square, double max_px) {
  RectanglePair result;
  result.reason = mistake_of(corners_px);
  if (!result.reason.empty()) return result;
  // Centred and scaled: the cross products then lose no digits.
  const Vector2d centre = (corners_px[0] + corners_px[1] + corners_px[2] + corners_px[3]) / 4;
  const double size = size_of(corners_px);
  RectangleCorners q;
  for (std::size_t i = 0; i < 4; ++i) q[i] = (corners_px[i] - centre) / size;
  const auto [A, B, C, D] = q;
  const Vector3d V1 = line(A, B).cross(line(C, D)), V2 = line(A, D).cross(line(B, C));
  const auto point = [&](const Vector3d& V) -> std::optional<Vector2d> {
    if (!(std::abs(V.z()) * infinity_in_sizes > V.head<2>().norm())) return std::nullopt;
    const Vector2d v_px = centre + size * V.hnormalized();
    if (max_px > 0 && v_px.norm() > max_px) return std::nullopt;
    return v_px;
  };
  const auto take = [&](const Vector3d& first, const Vector3d& second) {
    const auto v1_px = point(first), v2_px = point(second);
    if (v1_px && v2_px) result.pair = VanishingPair{*v1_px, *v2_px};
    return result.pair.has_value();
  };
  if (take(V1, V2)) return result;
  const Vector3d horizon = V1.normalized().cross(V2.normalized());
  result.from_diagonals = square && take(line(A, C).cross(horizon), line(B, D).cross(horizon));
  if (!result.pair)
    result.reason = square ? "the plane is parallel to the chip (or nearly): no constraint"
                           : "two sides are parallel in the image (or nearly): no constraint";
  return result;
}

RectanglePose rectangle_pose(const CameraModel& camera, const RectangleCorners& corners_px,
                             const RectangleSize& size) {
  RectanglePose result;
  result.reason = mistake_of(corners_px);
  if (!(size.ratio > 0) || !(size.side_mm > 0)) result.reason = "ratio and side must be above 0";
  if (!result.reason.empty()) return result;
  Rays rays;
  for (int i = 0; i < 4; ++i) {
    const auto d = ray(camera, corners_px[static_cast<std::size_t>(i)]);
    if (!d) return refused(result, "a corner lies outside the range of the lens model");
    rays.col(i) = *d;
  }
  // B - A = C - D with depths along the rays: b - c + d = a for A at depth 1.
  Eigen::Matrix3d M;
  M << rays.col(1), -rays.col(2), rays.col(3);
  const Vector3d depths = M.inverse() * rays.col(0);
  if (!depths.allFinite() || !(depths.minCoeff() > 0))
    return refused(result, "no rectangle in front of the camera has these corners");
  const Vector3d side_x = depths(0) * rays.col(1) - rays.col(0),
                 side_y = depths(2) * rays.col(3) - rays.col(0);
  result.ratio_seen = side_y.norm() / side_x.norm();
  Eigen::Matrix3d R;
  R << side_x.normalized(), side_y.normalized(), side_x.cross(side_y).normalized();
  Pose X_CO = Pose::Identity();
  X_CO.linear() = nearest_rotation(R);
  X_CO.translation() = nearest_to_rays(rays, X_CO.linear() * corners_mm(size));
  const auto rms_px = corner_rms_px(camera, corners_px, X_CO * corners_mm(size));
  if (!rms_px) return refused(result, "the rectangle would not be in front of the camera");
  result.rms_px = *rms_px;
  result.X_CO = X_CO;
  return result;
}

}  // namespace zeropose
