// The place of a point that two or more cameras see (spec 50 M2).
#pragma once

#include <Eigen/Core>
#include <span>
#include <string>
#include <vector>

#include "calib/camera_model.h"
#include "measure/code.h"
#include "measure/pose.h"

namespace zeropose {

struct TriangulationProblem {
  std::span<const CalibratedCamera> cameras;
  std::span<const Observation> observations;  // of one point: Observation::mark is not read
  double system_sigma_px = 0;  // calibration errors, in every pixel coordinate beside its covariance
};

// p_W and its covariance are in the frame of the cameras' poses: W, or S where they are those of a stereo
// sensor.
struct TriangulatedPoint {
  Code code = Code::internal;
  std::string reason;  // one sentence with the numbers, empty when ok
  Eigen::Vector3d p_W_mm = Eigen::Vector3d::Zero();
  Eigen::Matrix3d covariance_mm2 = Eigen::Matrix3d::Zero();
  // Two rays: their shortest distance. More: root mean square distance of the point from the rays.
  double ray_gap_mm = 0;
  std::vector<Eigen::Vector2d> deviations_px;  // found - projected, one per observation
};

// Starts where the rays come nearest to each other (least squares, for two cameras as in spec 50 M2) and
// minimises the deviations in all images, whitened with the observations' covariance (Gauss-Newton).
//
// Codes: marks_invalid (an index out of range, a number that is none, a covariance that is not positive, a
// pixel without a ray), too_few_cameras (fewer than two), geometry_degenerate (the rays are parallel within
// ten sigmas of their angle), not_converged (the rays meet behind a camera, or no point is seen by all),
// deviation_not_attributable (the deviations are larger than their covariance allows, 0.1 % false alarm).
// Ray gap and deviations are filled in where there is an estimate, whatever the code; the place counts only
// when the code is ok.
TriangulatedPoint triangulate(const TriangulationProblem& problem);

}  // namespace zeropose
