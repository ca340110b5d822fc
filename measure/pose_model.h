// The observations of a pose problem, linearised at a pose: what the pose estimate is made of (spec 50 M3).
// Internal to the room: use measure/pose.h.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <memory>
#include <span>

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
// Here and in everything that is made of it the rotation is measured in mm at the extent of the marks.
struct NormalEquations {
  Matrix6 N = Matrix6::Zero();
  Vector6 g = Vector6::Zero();
  double cost = 0;
};

// Two observations side by side: vector instructions of every processor take them at once.
inline constexpr std::size_t lane_count = 2;
using Lanes = Eigen::Array<double, lane_count, 1>;

// What is known of lane_count observations, and their linearisation r(delta) = r - J delta, whitened.
struct SightBlock {
  std::array<Lanes, 9> R_CW;     // row by row
  std::array<Lanes, 3> p_CW_mm;  // the world's origin
  std::array<Lanes, 3> p_MQ_mm;  // the mark's centre, axes of O
  std::array<Lanes, 3> normal_O;
  Lanes radius2_mm2;  // of the disc or ball that was measured; 0: a point
  std::array<Lanes, 2> focal_px, origin_px;
  Lanes K;
  std::array<Lanes, 2> u_px;
  std::array<Lanes, 3> whitening;  // W with W' W = P: 11, 12, 22; weight 0 counts as 1 here
  Lanes weight, active;            // active: 1 takes part in the estimate, 0 does not

  std::array<Lanes, 2> bend_px;  // what the lens adds to the place of the outline's image
  std::array<Lanes, 2> dev_px;   // found - projected
  Lanes depth_mm;
  std::array<Lanes, 6> row1, row2;  // of W J, J = [A, -A [q]x], A the derivative by the mark's position
  std::array<Lanes, 2> Wr;
  std::array<bool, lane_count> visible;  // has an image at the pose of the linearisation

  std::array<Lanes, 3> own, total;  // covariance of W r: 11, 12, 22
  Lanes normalised;                 // deviation by its standard deviation
};

// The equations of all observations of a problem. Precondition: the problem's numbers were checked; the
// problem outlives the model.
class PoseModel {
 public:
  explicit PoseModel(const PoseProblem& problem);

  std::size_t size() const { return problem_.observations.size(); }
  const Observation& observation(std::size_t i) const { return problem_.observations[i]; }
  const Mark& mark(std::size_t i) const { return problem_.marks[observation(i).mark]; }
  const CalibratedCamera& camera(std::size_t i) const { return problem_.cameras[observation(i).camera]; }
  Eigen::Vector3d p_MQ_mm(std::size_t i) const { return mark(i).p_O_mm - centroid_O_mm_; }

  bool active(std::size_t i) const { return block(i).active[lane(i)] > 0; }
  void set_active(std::size_t i, bool active) { blocks_[i / lane_count].active[lane(i)] = active ? 1 : 0; }
  int active_count() const;

  bool planar() const { return planar_; }
  int unknowns() const { return planar_ ? 3 : 6; }
  // The directions that are free, orthonormal columns; only for planar problems.
  const Eigen::Matrix<double, 6, 3>& planar_basis() const { return planar_basis_; }
  const Pose& X_WP() const { return X_WP_; }

  const Eigen::Vector3d& centroid_O_mm() const { return centroid_O_mm_; }
  double extent_mm() const { return extent_mm_; }  // root mean square distance of the marks from M
  CentredPose centred(const Pose& X_WO) const;     // planar: the nearest pose in the plane
  Pose pose(const CentredPose& pose) const;        // X_WO

  // The eccentricity of a disc's image has a part of perspective, exact at every pose, and a much smaller
  // part of the lens. That one changes so slowly that it is held within some millimetres: true where it must
  // be computed anew.
  bool bends_are_old(const CentredPose& pose) const;
  void refresh_bends(const CentredPose& pose);

  // Linearises all observations and adds up the active ones. False when one of these has no image.
  bool linearise(const CentredPose& pose, NormalEquations& equations);

  // At the last linearisation.
  bool visible(std::size_t i) const { return block(i).visible[lane(i)]; }
  Eigen::Vector2d dev_px(std::size_t i) const { return pick(i, block(i).dev_px); }
  double rms_rad() const;                       // of the active observations
  Eigen::Vector2d dev_mm(std::size_t i) const;  // at the mark's distance
  Eigen::Vector2d Wr(std::size_t i) const { return pick(i, block(i).Wr); }
  Eigen::Matrix<double, 2, 6> WJ(std::size_t i) const;

  // Covariances of the whitened residuals at the last linearisation: by the marks' own covariance, and with
  // that of the system and of non-rigidity. Plain: both are the unit matrix, for observations of any weight,
  // and need not be computed.
  bool plain() const { return plain_; }
  void refresh_covariances();
  Eigen::Matrix2d total_covariance(std::size_t i) const;

  double normalised(std::size_t i) const { return block(i).normalised[lane(i)]; }
  std::span<SightBlock> blocks() { return {blocks_.get(), block_count_}; }
  std::span<const SightBlock> blocks() const { return {blocks_.get(), block_count_}; }

 private:
  static std::size_t lane(std::size_t i) { return i % lane_count; }
  const SightBlock& block(std::size_t i) const { return blocks_[i / lane_count]; }
  static Eigen::Vector2d pick(std::size_t i, const std::array<Lanes, 2>& lanes) {
    return {lanes[0][lane(i)], lanes[1][lane(i)]};
  }
  void fill(std::size_t i, const Observation& observation);
  void centre();
  void linearise_lane(const std::array<Lanes, 3>& p_C_mm, const std::array<Lanes, 3>& normal_C, std::size_t i,
                      std::array<Lanes, 6>& WD);
  Eigen::Matrix2d own_covariance_mm2(std::size_t i) const;

  const PoseProblem& problem_;
  std::size_t block_count_;
  std::unique_ptr<SightBlock[]> blocks_;
  bool algebraic_, planar_, plain_, has_discs_ = false, one_lens_ = true;
  double system_variance_px2_;
  Pose X_WP_ = Pose::Identity();
  Eigen::Matrix<double, 6, 3> planar_basis_ = Eigen::Matrix<double, 6, 3>::Zero();
  Eigen::Vector3d centroid_O_mm_ = Eigen::Vector3d::Zero();
  double extent_mm_ = 1;
  bool bends_known_ = false;
  CentredPose bends_at_;
};

}  // namespace zeropose
