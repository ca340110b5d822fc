// The pose of a camera whose internals are known (spec 40 P4): from points on its housing, from one of them
// and reference points, or from reference points alone.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "calib/calibration.h"

namespace zeropose {

// A point of the camera's housing: known in C from the laboratory, measured in W on site.
struct HousingFeature {
  Eigen::Vector3d p_C_mm = Eigen::Vector3d::Zero();
  Eigen::Vector3d p_W_mm = Eigen::Vector3d::Zero();
  double sigma_mm = 0.02;  // of one coordinate of p_W - X_WC p_C: laboratory and tracker together, > 0
};

struct PoseOnlyProblem {
  CameraModel model;
  std::span<const CalibrationPoint> points;  // discs are taken as points
  std::span<const HousingFeature> features;
  // Where the camera is believed to be: decides between poses that explain the points equally well.
  std::optional<Pose> X_WC_near;
  double sigma_px = 0;  // of one pixel coordinate, scales the covariances; 0: from the residuals
  // algebraic: distances of the points from their lines of sight in mm (P4 b as published), all alike
  // whatever their distance; covariances of the pixels are not used, and that of the pose is approximate.
  Residual residual = Residual::reprojection;
  bool reject_wrong_points = true;
};

enum class PoseOnlyStatus {
  failed = 0,
  ok,
  wrong_problem,   // a sigma or a covariance that is none
  not_finite,      // a number that is none, a pixel that is outside the lens model's range
  too_few_points,  // without features fewer than 4 (3 with X_WC_near), with one or two fewer than 2
  collinear,       // the points lie on a line
  ambiguous,       // several poses explain the points equally well
  not_determined,  // the points leave a direction open
  contradiction,   // the points contradict each other and it is open which one is wrong
  not_converged
};
std::string_view name_of(PoseOnlyStatus status);

struct PoseOnlyResult {
  PoseOnlyStatus status = PoseOnlyStatus::failed;
  std::string reason;  // one sentence with the numbers, empty when ok
  Pose X_WC = Pose::Identity();
  Matrix6 covariance = Matrix6::Zero();  // of the delta in moved(): mm, rad, axes of W, about C's origin
  double sigma_px = 0;  // of one coordinate: as given, from the residuals, or 0.1 where there is neither
  double rms_px = 0;    // root of the mean squared point distance, over the points used
  int redundancy = 0;
  double condition = 0;
  std::vector<CalibrationDeviation> deviations;  // in the order of the points, where there is an estimate
  std::vector<Eigen::Vector3d> feature_deviations_mm;  // p_W - X_WC p_C
  std::vector<std::size_t> removed;                    // points that contradict the others, worst first
  std::vector<std::size_t> suspects;                   // contradiction: one of these
  std::vector<Pose> alternatives;                      // further poses that explain the points as well
};

// Three features and more without points: best fit. Else maximum likelihood: the six numbers of the pose from
// the pixels and the features, each weighted with its covariance. With one feature this is the procedure of
// P4 b (p_Wi - p_WF = R_WC (lambda_i d_i - p_CF)), but for residuals in px instead of mm. Converges without a
// start. A wrong point is taken out as in remove_wrong_points().
PoseOnlyResult calibrate_pose(const PoseOnlyProblem& problem);

}  // namespace zeropose
