// A plane in space as one camera sees it.
#pragma once

#include <optional>

#include "calib/camera_model.h"

namespace zeropose {

class PlaneView {
 public:
  PlaneView(const CameraModel& camera, const Pose& X_CM);  // the plane z = 0 of M; keeps the camera

  // Where the line of sight of a pixel meets it, in M; nullopt where it does not, or only behind the camera.
  std::optional<Eigen::Vector2d> meet(const Eigen::Vector2d& u_px) const;

  // How a place of it moves in the image; nullopt where it has none.
  std::optional<Eigen::Matrix2d> px_per_mm(const Eigen::Vector2d& q_mm) const;

 private:
  const CameraModel& camera_;
  Pose X_CM_;
  Eigen::Matrix3d R_MC_;
  Eigen::Vector3d p_MC_mm_;
};

}  // namespace zeropose
