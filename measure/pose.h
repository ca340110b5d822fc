// The pose of an object from marks in any number of cameras (spec 50 M3).
#pragma once

#include <Eigen/Core>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "calib/camera_model.h"
#include "calib/residual.h"
#include "measure/code.h"
#include "measure/job.h"

namespace zeropose {

// A found pixel of a mark in one frame. Indices into PoseProblem::cameras and ::marks.
struct Observation {
  std::size_t camera = 0;
  std::size_t mark = 0;
  Eigen::Vector2d u_px = Eigen::Vector2d::Zero();  // centre of the mark's image (for a disc: of the ellipse)
  Eigen::Matrix2d covariance_px2 = Eigen::Matrix2d::Identity();
  double radius_share = 1;  // MarkFinding::radius_share
};

struct PoseProblem {
  std::span<const CalibratedCamera> cameras;
  std::span<const Mark> marks;
  std::span<const Observation> observations;
  std::optional<Pose> X_WO_start;   // none: any pose (start by depth factors)
  std::optional<Pose> X_WP_planar;  // a sheet: only x, y, rz in this plane are free
  double system_sigma_px = 0;
  Residual residual = Residual::reprojection;
  bool reject_wrong_marks = true;  // M6.3
};

// Found minus projected for one observation, in the order of the problem.
struct Deviation {
  Eigen::Vector2d dev_px = Eigen::Vector2d::Zero();
  Eigen::Vector2d dev_mm = Eigen::Vector2d::Zero();  // at the mark's distance: dev_px / f * zc
  double normalised = 0;                             // by its standard deviation (data snooping)
  bool used = false;                                 // took part in the final estimate
  bool removed = false;                              // thrown out as wrong
};

struct PoseResult {
  Code code = Code::internal;
  std::string reason;  // one sentence with the numbers, empty when ok
  Pose X_WO = Pose::Identity();
  Matrix6 covariance = Matrix6::Zero();  // of the delta in moved(): mm, rad, axes of W, about O's origin;
                                         // from the observations' covariance and the users' weights
  Matrix6 total_covariance = Matrix6::Zero();  // the same with system_sigma_px and the marks' sigma_mm: what
                                               // the result deserves
  std::vector<Deviation> deviations;
  std::vector<std::size_t> removed;  // observations, in the order of removal
  int effective_marks = 0;
  int effective_cameras = 0;
  int redundancy = 0;    // equations minus unknowns
  double condition = 0;  // of the normal matrix scaled by the marks' extent, 1-norm
  // When several poses explain the marks equally well (geometry_degenerate; three marks in one camera have up
  // to four): all of them, each refined, best first; otherwise empty.
  std::vector<Pose> alternatives{};
};

// Gauss-Newton with Levenberg's damping on the whitened residuals, weights as the user's: with W the weights
// and J the whitened Jacobian, N = J' W^2 J and covariance = N^-1 (J' W^4 J) N^-1. Repeatable bit by bit.
//
// Codes: marks_invalid (an index out of range, a number that is none, a covariance that is not positive, a
// mark twice in one camera: the two would vouch for each other), too_few_marks (fewer than 3 with weight, 2
// if planar), geometry_degenerate (the marks leave a direction open, or several poses explain them equally
// well), not_converged, deviation_not_attributable. Deviations are filled in where there is an estimate,
// whatever the code; X_WO and the covariances count only when the code is ok.
//
// Wrong marks: an observation is wrong when its deviation is above the mark's tolerance, or above its own
// standard deviation by more than chance allows (0.1 % per estimate). The smallest set of observations
// without which all others agree is removed, if no other set of that size does nearly as well (likelihood
// ratio below 1000) with another pose (four standard deviations away) and if the rest still checks itself and
// is more than what was removed. Otherwise nobody knows which one is wrong: deviation_not_attributable.
PoseResult estimate_pose(const PoseProblem& problem);

}  // namespace zeropose
