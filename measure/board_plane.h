// How the plane of a board is seen: a homography behind a lens with one radial parameter. Internal to the
// room: it tells places on the board from clutter; the camera is calibrated elsewhere.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <span>
#include <vector>

namespace zeropose {

// A place on the plane (any unit) and its pixel.
struct PlanePair {
  Eigen::Vector2d place = Eigen::Vector2d::Zero();
  Eigen::Vector2d u_px = Eigen::Vector2d::Zero();
};

// Pixels are undistorted about the image's middle by the division model (spec 20, E1) in units of half the
// diagonal, then mapped by a homography.
class BoardPlane {
 public:
  // Least squares, with weights that bound the pull of outliers. At least four pairs, no three on a line when
  // there are just four; the lens counts as straight below 12 pairs. Nothing when the pairs do not determine
  // it.
  static std::optional<BoardPlane> fit(std::span<const PlanePair> pairs, int width_px, int height_px);

  // Nothing behind the vanishing line, or where the lens has no image.
  std::optional<Eigen::Vector2d> pixel(const Eigen::Vector2d& place) const;
  std::optional<Eigen::Vector2d> place(const Eigen::Vector2d& u_px) const;
  // d pixel / d place
  std::optional<Eigen::Matrix2d> stretch(const Eigen::Vector2d& place) const;

 private:
  Eigen::Vector2d middle_px_ = Eigen::Vector2d::Zero();
  double unit_px_ = 1, bend_ = 0;
  Eigen::Matrix3d H_ = Eigen::Matrix3d::Identity(), inverse_ = Eigen::Matrix3d::Identity();
};

}  // namespace zeropose
