// The calibration of one camera from known points and their pixels: what goes in and what comes out
// (spec 30). calibrate() is the whole way C7; its steps stand in coplanar.h, noncoplanar.h, linear.h,
// origin_search.h and refine.h and can be called by themselves.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "calib/camera_model.h"
#include "calib/parameters.h"
#include "calib/residual.h"

namespace zeropose {

// A point with known coordinates and the pixel where the camera saw it. W is whatever frame the points are
// given in: world, robot base, calibration body or board.
struct CalibrationPoint {
  Eigen::Vector3d p_W_mm = Eigen::Vector3d::Zero();
  Eigen::Vector2d u_px = Eigen::Vector2d::Zero();
  Eigen::Matrix2d covariance_px2 = Eigen::Matrix2d::Identity();
  // A flat disc: the pixel is then the centre of its image, not the image of its centre
  // (calib/eccentricity.h).
  double disc_radius_mm = 0;                                // 0: not a disc
  Eigen::Vector3d disc_normal_W = Eigen::Vector3d::Zero();  // any length and either sign
};

enum class LensModel { division, brown };
enum class CalibrationMethod { automatic, coplanar, noncoplanar, linear };

// automatic: distortion_dominant for few points with depth, else joint (spec 30 C6).
enum class Refinement { automatic, none, joint, distortion_dominant, origin_dominant };

// Internals to begin with, and the pose where it is known as well.
struct CalibrationStart {
  CameraModel model;
  std::optional<Pose> X_WC;
};

struct CalibrationProblem {
  std::span<const CalibrationPoint> points;
  int width_px = 0, height_px = 0;
  LensModel lens = LensModel::division;
  CalibrationMethod method = CalibrationMethod::automatic;
  Refinement refinement = Refinement::automatic;
  Residual residual = Residual::reprojection;
  double robust =
      0;  // Cauchy's loss from about this many px on (sigmas, where covariances are given); 0: off
  ParameterSet fixed;          // held at the start's values (an origin without a start: at origin_px)
  bool one_focal = false;      // fx = fy
  bool search_origin = false;  // C5 also when the refinement would not ask for it
  std::optional<CalibrationStart> start;
  std::optional<Eigen::Vector2d> origin_px;  // none: the start's, else the image centre
  std::optional<double> tz_mm;               // distance of a board parallel to the chip (C1)
  double reject_px = 0, reject_mm = 0;       // a point with a larger deviation is thrown out; 0: never
  double sigma_px = 0;  // of one pixel coordinate, scales the covariances; 0: from the residuals
};

// ok or what is wrong with the input. Every one but ok comes with a reason and without numbers for a camera.
enum class CalibrationStatus {
  failed = 0,
  ok,
  wrong_problem,  // sizes, options that contradict each other, a start that is missing
  not_finite,     // a number that is none
  too_few_points,
  duplicate_points,  // the same point or pixel twice with different partners, or nothing but repetitions
  collinear,
  coplanar,          // the method needs depth: all points, or all but one, lie in one plane
  parallel_to_chip,  // a board parallel to the chip: distance and focal length cannot be told apart
  all_in_centre,     // the pixels span too little of the image
  behind_camera,     // points on both sides of the camera
  not_determined,    // the normal equations are singular
  not_converged
};
std::string_view name_of(CalibrationStatus status);

struct CalibrationDeviation {
  Eigen::Vector2d dev_px = Eigen::Vector2d::Zero();  // found minus projected
  Eigen::Vector2d dev_mm = Eigen::Vector2d::Zero();  // at the point's distance: dev_px / f * zc
  double depth_mm = 0;                               // zc
  bool used = false;
};

// One step on the way, for the report: "C2 non-coplanar", "origin search", "refinement", "rejected 3 points".
struct CalibrationStep {
  std::string name;
  std::string detail;  // numbers in words
  double rms_px = 0;   // after it, over the points used
};

struct CalibrationDiagnosis {
  double condition = 0;  // of the normal matrix scaled to a unit diagonal (or of the linear system)
  bool coplanar = false;
  std::vector<std::string> warnings;
};

// Estimates with their covariance in the order of `parameters`: px, K and k1.. without unit, x y z mm, rx ry
// rz rad: the delta of moved(X_WC), but where one of the angles is fixed alone, the six numbers' angles.
struct ParameterCovariance {
  std::vector<Parameter> parameters;  // the free ones
  Eigen::MatrixXd covariance;
};

struct CalibrationResult {
  CalibrationStatus status = CalibrationStatus::failed;
  std::string reason;  // one sentence with the numbers, empty when ok
  CameraModel model;
  Pose X_WC = Pose::Identity();
  ParameterCovariance uncertainty;  // empty without refinement
  double sigma_px = 0;              // of one coordinate: as given, or from the residuals
  double rms_px = 0;                // root of the mean squared point distance, over the points used
  double residual_sum = 0;          // sum of the squared residuals that were minimised (reprojection: px^2)
  std::vector<CalibrationDeviation> deviations;  // in the order of the points
  std::vector<CalibrationStep> steps;
  CalibrationDiagnosis diagnosis;
};

// C7: linear start by the method that suits the points (C1, C2, C3), origin search C5, refinement C6, then
// points whose deviation exceeds the threshold are dropped, worst first, until none does.
CalibrationResult calibrate(const CalibrationProblem& problem);

}  // namespace zeropose
