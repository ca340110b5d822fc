// Closed-form starts for the pose and focal length of a camera without distortion (Z. Zhang 2000; spec 30
// C3).
#pragma once

#include <Eigen/Core>
#include <optional>
#include <span>

#include "calib/rigid.h"

namespace zeropose {

// A point of a body and where it is seen.
struct ImagedPoint {
  Eigen::Vector3d p_mm;
  Eigen::Vector2d u;  // px, or normalised coordinates
};

// The projective map from the points' x y (z is not read) to u, by the direct linear transform with
// normalised coordinates. h(2, 2) may be 0. nullopt: fewer than 4 points, or the points or their images lie
// on a line.
std::optional<Eigen::Matrix3d> homography(std::span<const ImagedPoint> pairs);

// X_CB of a plane z = 0 from its homography to normalised coordinates, in front of the camera; nullopt: the
// points stand on both sides of it.
std::optional<Pose> pose_of_plane(const Eigen::Matrix3d& H, std::span<const ImagedPoint> pairs);

// The 3x4 projection of points that do not lie in a plane; nullopt: fewer than 6, or degenerate.
std::optional<Eigen::Matrix<double, 3, 4>> projection_matrix(std::span<const ImagedPoint> pairs);

// X_CB from the projection to normalised coordinates; nullopt: mirrored, or on both sides of the camera.
std::optional<Pose> pose_of_projection(const Eigen::Matrix<double, 3, 4>& P,
                                       std::span<const ImagedPoint> pairs);

// One focal length (px) from homographies into pixels relative to the image origin: the two constraints of
// every plane by least squares. nullopt: the planes say nothing about it, e.g. all are parallel to the chip.
std::optional<double> focal_of_planes(std::span<const Eigen::Matrix3d> homographies);

// fx and fy about the given origin from a projection matrix into pixels relative to the origin.
std::optional<double> focal_of_projection(const Eigen::Matrix<double, 3, 4>& P);

}  // namespace zeropose
