// The observations of a pose problem, linearised at a pose: what the pose estimate is made of (spec 50 M3).
// Internal to the room: use measure/pose.h.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <vector>

#include "measure/pose.h"

namespace zeropose {

// A pose of the object by the position of the marks' centroid M: as well conditioned as the marks allow,
// wherever O lies.
struct CentredPose {
  Eigen::Matrix3d R_WO = Eigen::Matrix3d::Identity();
  Eigen::Vector3d p_WM_mm = Eigen::Vector3d::Zero();
};

// delta = (translation mm, rotation rad), both along the axes of W, the rotation about M.
CentredPose moved(const CentredPose& pose, const Vector6& delta);

// N = sum J' P J, g = sum J' P r, cost = sum r' P r over the active observations, P the information matrices.
struct NormalEquations {
  Matrix6 N = Matrix6::Zero();
  Vector6 g = Vector6::Zero();
  double cost = 0;
};

// One observation: what is known, and its linearisation r(delta) = r - J delta with
// J = [A, -A [q]x].
struct Sight {
  const CameraModel* camera = nullptr;
  const Mark* mark = nullptr;
  std::size_t camera_index = 0, mark_index = 0;
  Eigen::Matrix3d R_CW;
  Eigen::Vector3d p_WC_mm;
  Eigen::Vector3d p_MQ_mm;  // the mark's centre, axes of O
  Eigen::Vector2d u_px;
  Eigen::Matrix2d covariance_px2;
  Eigen::Matrix2d information;  // P
  Eigen::Matrix2d whitening;    // W with W' W = P; for an observation of weight 0 as if its weight were 1
  bool has_offset = false;      // radius and normal are known
  bool active = false;          // takes part in the estimate
  bool visible = false;         // has an image at the pose of the linearisation

  double radius_share = 1;                              // of the mark's radius: the circle that was measured
  Eigen::Vector2d offset_px = Eigen::Vector2d::Zero();  // eccentricity of the mark's image
  Eigen::Vector2d r = Eigen::Vector2d::Zero();          // px, or mm for algebraic residuals
  Eigen::Matrix<double, 2, 3> A =
      Eigen::Matrix<double, 2, 3>::Zero();           // derivative of the prediction by the mark's position
  Eigen::Vector3d q = Eigen::Vector3d::Zero();       // R_WO * p_MQ
  Eigen::Vector2d dev_px = Eigen::Vector2d::Zero();  // found - projected
  double depth_mm = 0;
  Eigen::Matrix<double, 6, 2> WJ = Eigen::Matrix<double, 6, 2>::Zero();  // (W J)'
  Eigen::Vector2d Wr = Eigen::Vector2d::Zero();

  Eigen::Matrix<double, 2, 6> J() const;
};

// The equations of all observations of a problem. Precondition: the problem's numbers were checked.
class PoseModel {
 public:
  explicit PoseModel(const PoseProblem& problem);

  std::vector<Sight>& sights() { return sights_; }
  const std::vector<Sight>& sights() const { return sights_; }
  int active_count() const;

  bool planar() const { return planar_; }
  int unknowns() const { return planar_ ? 3 : 6; }
  // The directions that are free, orthonormal columns; only for planar problems.
  const Eigen::Matrix<double, 6, 3>& planar_basis() const { return planar_basis_; }
  const Pose& X_WP() const { return X_WP_; }

  const Eigen::Vector3d& centroid_O_mm() const { return centroid_O_mm_; }
  double extent_mm() const { return extent_mm_; }  // root mean square distance of the marks from M

  CentredPose centred(const Pose& X_WO) const;  // planar: the nearest pose in the plane
  Pose pose(const CentredPose& pose) const;     // X_WO

  // The eccentricity of each disc's image at this pose. It changes so slowly that it is held during the last
  // steps.
  void refresh_offsets(const CentredPose& pose);
  // Linearises the active observations and adds them up. False when one of them has no image.
  bool linearise(const CentredPose& pose, NormalEquations& equations);
  // Linearises those that are not active, for their deviations.
  void linearise_unused(const CentredPose& pose);

  // Covariance of an observation's residual noise at the last linearisation: the mark's own, the system's and
  // that of non-rigidity, in the units of r.
  Eigen::Matrix2d own_covariance(const Sight& sight) const;
  Eigen::Matrix2d total_covariance(const Sight& sight) const;

 private:
  bool linearise(const CentredPose& pose, Sight& sight) const;
  bool linearise_algebraic(const Eigen::Vector3d& p_C_mm, Sight& sight) const;

  std::vector<Sight> sights_;
  Residual residual_;
  double system_variance_px2_;
  bool planar_;
  Pose X_WP_ = Pose::Identity();
  Eigen::Matrix<double, 6, 3> planar_basis_ = Eigen::Matrix<double, 6, 3>::Zero();
  Eigen::Vector3d centroid_O_mm_ = Eigen::Vector3d::Zero();
  double extent_mm_ = 1;
};

}  // namespace zeropose
