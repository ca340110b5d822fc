#include "sim/shapes.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace zeropose {
namespace {

using Eigen::Vector2d;

Shape make(ShapeKind kind, const Vector2d& centre_mm, double angle_rad, const Vector2d& half_mm,
           double corner_mm) {
  return {kind, centre_mm, Vector2d(std::cos(angle_rad), std::sin(angle_rad)), half_mm, corner_mm};
}

double box_distance(const Vector2d& p, const Vector2d& half, double corner) {
  const Vector2d beyond = p.cwiseAbs() - half + Vector2d::Constant(corner);
  return beyond.cwiseMax(0).norm() + std::min(beyond.maxCoeff(), 0.0) - corner;
}

double hexagon_distance(const Vector2d& p, double inner_radius) {
  const double x = std::abs(p.x()), y = std::abs(p.y());
  return std::max(x, x / 2 + y * std::numbers::sqrt3 / 2) - inner_radius;
}

}  // namespace

Shape rounded_box(const Vector2d& centre_mm, double angle_rad, const Vector2d& half_mm, double corner_mm) {
  return make(ShapeKind::rounded_box, centre_mm, angle_rad, half_mm, corner_mm);
}

Shape disc(const Vector2d& centre_mm, double radius_mm) {
  return make(ShapeKind::rounded_box, centre_mm, 0, Vector2d::Constant(radius_mm), radius_mm);
}

Shape hexagon(const Vector2d& centre_mm, double angle_rad, double inner_radius_mm) {
  return make(ShapeKind::hexagon, centre_mm, angle_rad, Vector2d::Constant(inner_radius_mm), 0);
}

Shape half_disc(const Vector2d& centre_mm, double angle_rad, double radius_mm) {
  return make(ShapeKind::half_disc, centre_mm, angle_rad, Vector2d::Constant(radius_mm), 0);
}

double signed_distance_mm(const Shape& shape, const Vector2d& q_mm) {
  const Vector2d d = q_mm - shape.centre_mm;
  const Vector2d p(shape.axis.dot(d), shape.axis.x() * d.y() - shape.axis.y() * d.x());
  switch (shape.kind) {
    case ShapeKind::rounded_box:
      return box_distance(p, shape.half_mm, shape.corner_mm);
    case ShapeKind::hexagon:
      return hexagon_distance(p, shape.half_mm.x());
    case ShapeKind::half_disc:
      return std::max(p.norm() - shape.half_mm.x(), -p.y());
  }
  return 0;
}

double bounding_radius_mm(const Shape& shape) {
  switch (shape.kind) {
    case ShapeKind::rounded_box:
      return (shape.half_mm - Vector2d::Constant(shape.corner_mm)).norm() + shape.corner_mm;
    case ShapeKind::hexagon:
      return shape.half_mm.x() * 2 / std::numbers::sqrt3;
    case ShapeKind::half_disc:
      return shape.half_mm.x();
  }
  return 0;
}

}  // namespace zeropose
