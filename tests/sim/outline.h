// Outlines in an image, from points on them: an independent way to what the renderer has to show.
#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "calib/camera_model.h"
#include "measure/job.h"

namespace zeropose::test {

using Eigen::Vector2d;
using Eigen::Vector3d;

// A projected outline: points all round, its area centroid, its largest radius.
struct Outline {
  std::vector<Vector2d> points;
  Vector2d centroid = Vector2d::Zero();
  double area_px2 = 0, radius_px = 0;
};

inline Outline outline_through(std::vector<Vector2d> points) {
  Outline outline;
  outline.points = std::move(points);
  Vector2d moment = Vector2d::Zero();
  const Vector2d origin = outline.points.front();
  for (std::size_t i = 0; i < outline.points.size(); ++i) {
    const Vector2d a = outline.points[i] - origin,
                   b = outline.points[(i + 1) % outline.points.size()] - origin;
    const double cross = a.x() * b.y() - a.y() * b.x();
    outline.area_px2 += cross / 2;
    moment += cross / 6 * (a + b);
  }
  outline.centroid = origin + moment / outline.area_px2;
  outline.area_px2 = std::abs(outline.area_px2);
  for (const Vector2d& point : outline.points)
    outline.radius_px = std::max(outline.radius_px, (point - outline.centroid).norm());
  return outline;
}

inline constexpr int outline_points = 720;

// Of a disc.
inline Outline outline_of(const CalibratedCamera& camera, const Mark& mark, const Pose& X_WO) {
  const Pose X_CO = camera.X_WC.inverse() * X_WO;
  const Vector3d across = mark.normal_O.unitOrthogonal(), other = mark.normal_O.normalized().cross(across);
  std::vector<Vector2d> points;
  for (int i = 0; i < outline_points; ++i) {
    const double angle = 2 * std::numbers::pi * i / outline_points;
    const Vector3d p_O = mark.p_O_mm + mark.radius_mm * (std::cos(angle) * across + std::sin(angle) * other);
    points.push_back(project(camera.model, X_CO * p_O).value());
  }
  return outline_through(std::move(points));
}

// Of a ball: all round, the last line of sight that still meets it, found by halving.
inline Outline ball_outline_of(const CalibratedCamera& camera, const Mark& mark, const Pose& X_WO) {
  const Vector3d p_C = camera.X_WC.inverse() * X_WO * mark.p_O_mm;
  const Vector3d across = p_C.unitOrthogonal(), other = p_C.normalized().cross(across);
  const auto meets = [&](const Vector3d& direction) {
    return p_C.cross(direction.normalized()).norm() < mark.radius_mm;
  };
  std::vector<Vector2d> points;
  for (int i = 0; i < outline_points; ++i) {
    const double angle = 2 * std::numbers::pi * i / outline_points;
    const Vector3d out = std::cos(angle) * across + std::sin(angle) * other;
    double inside = 0, outside = 2 * mark.radius_mm;
    for (int halving = 0; halving < 60; ++halving) {
      const double middle = (inside + outside) / 2;
      (meets(p_C + middle * out) ? inside : outside) = middle;
    }
    points.push_back(project(camera.model, p_C + inside * out).value());
  }
  return outline_through(std::move(points));
}

}  // namespace zeropose::test
