// Flat shapes that things in a rendered picture are made of.
#pragma once

#include <Eigen/Core>

namespace zeropose {

enum class ShapeKind { rounded_box, hexagon, half_disc };

// In the plane of its sheet, mm. A rounded box with corner radius = the smaller half size is a slot, with
// both half sizes alike a disc.
struct Shape {
  ShapeKind kind = ShapeKind::rounded_box;
  Eigen::Vector2d centre_mm = Eigen::Vector2d::Zero();
  Eigen::Vector2d axis = Eigen::Vector2d::UnitX();  // direction of the first half size
  Eigen::Vector2d half_mm =
      Eigen::Vector2d::Ones();  // hexagon: x is the inner radius; half disc: x the radius
  double corner_mm = 0;
};

Shape rounded_box(const Eigen::Vector2d& centre_mm, double angle_rad, const Eigen::Vector2d& half_mm,
                  double corner_mm);
Shape disc(const Eigen::Vector2d& centre_mm, double radius_mm);
Shape hexagon(const Eigen::Vector2d& centre_mm, double angle_rad, double inner_radius_mm);
Shape half_disc(const Eigen::Vector2d& centre_mm, double angle_rad, double radius_mm);

// Distance of q from the outline, negative inside. Exact for boxes, near the outline for the others.
double signed_distance_mm(const Shape& shape, const Eigen::Vector2d& q_mm);

// Radius round the centre that the shape does not exceed.
double bounding_radius_mm(const Shape& shape);

}  // namespace zeropose
