// The least squares behind calibrate_pose(). Internal to calib.
#pragma once

#include <memory>

#include "calib/point_fit.h"
#include "calib/pose_only.h"

namespace zeropose {

// The equations of points and features at a pose. Pixels are whitened with their covariance, features with
// sigma_mm / scale_px: both then have residuals of scale_px. The problem is borrowed.
std::unique_ptr<PointEquations> equations_at(const PoseOnlyProblem& problem, double scale_px,
                                             const Pose& X_WC);

// Precondition: the fit is one of such equations.
Pose pose_of(const PointFit& fit);

struct CameraFits {
  PointFit best;                   // or what came nearest to one
  std::vector<Pose> alternatives;  // explain the points as well
  bool undecided = false;          // nothing tells which one is right
};

// Fits from the believed pose, from every pose that three of the points allow, or from the features.
CameraFits fits_from_anywhere(const PoseOnlyProblem& problem, double scale_px);

}  // namespace zeropose
