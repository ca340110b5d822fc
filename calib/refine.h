// Nonlinear refinement of one camera from one set of points (spec 30 C6).
#pragma once

#include <Eigen/Core>
#include <span>
#include <string>

#include "calib/calibration.h"

namespace zeropose {

struct RefineProblem {
  std::span<const CalibrationPoint> points;
  CameraModel start;
  Pose X_WC_start = Pose::Identity();
  ParameterSet fixed;      // parameters of the other lens model are always held
  bool one_focal = false;  // fx / fy held at the start's ratio
  Residual residual = Residual::reprojection;
  double robust = 0;  // Cauchy's loss, in units of the whitened residual (px without covariances); 0: squares
  int max_iterations = 200;  // 0: only the cost and the uncertainty at the start
};

struct RefineResult {
  CalibrationStatus status = CalibrationStatus::failed;
  std::string reason;
  CameraModel model;
  Pose X_WC = Pose::Identity();
  double cost = 0;  // sum of the squared residuals: whitened with the covariances, or px mm (algebraic)
  int iterations = 0;
  double condition = 0;             // of the normal matrix with a unit diagonal
  ParameterCovariance uncertainty;  // for residuals of unit variance: times sigma^2
};

// Levenberg-Marquardt on the normal equations with analytic Jacobians; discs' eccentricity is recomputed
// between rounds until it stands still. status: ok, wrong_problem, behind_camera (a point has no image in the
// start), too_few_points, not_determined (the reason names the parameters that cannot be told apart),
// not_converged.
RefineResult refine(const RefineProblem& problem);

// The parameters that refine() would estimate.
ParameterSet free_parameters(const RefineProblem& problem);

}  // namespace zeropose
