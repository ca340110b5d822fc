// Has a camera moved, and where is it now: from fixed points that it saw before and sees after (spec 60).
#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "calib/camera_model.h"
#include "measure/code.h"

namespace zeropose {

enum class RecalibrationMethod {
  known_points,      // coordinates in W: the whole pose from the pixels after
  arbitrary_points,  // no coordinates: the rotation alone, as if the camera had only turned about its centre
  groups  // coordinates inside each group (a plate): the whole change from the pixels before and after
};
std::string_view name_of(RecalibrationMethod method);  // known, arbitrary, groups

// A fixed point. Pixels before (old) and after (new) the camera was moved.
struct RecalibrationPoint {
  std::string name;
  std::string group;                                 // groups: points of one group have one name
  Eigen::Vector3d p_mm = Eigen::Vector3d::Zero();    // in W, or inside the group; arbitrary points: not used
  Eigen::Vector2d old_px = Eigen::Vector2d::Zero();  // known points: only looked at, for a warning
  Eigen::Vector2d new_px = Eigen::Vector2d::Zero();
  Eigen::Matrix2d old_covariance_px2 = Eigen::Matrix2d::Identity();
  Eigen::Matrix2d new_covariance_px2 = Eigen::Matrix2d::Identity();
};

struct RecalibrationProblem {
  RecalibrationMethod method = RecalibrationMethod::known_points;
  CameraModel model;
  Pose X_WCo = Pose::Identity();  // the camera as calibrated
  std::span<const RecalibrationPoint> points;
  double sigma_px = 0;  // of one pixel coordinate, scales the covariances; 0: from the residuals
};

// Found minus expected, px.
struct RecalibrationDeviation {
  Eigen::Vector2d old_px =
      Eigen::Vector2d::Zero();  // arbitrary points: zero, the pixel before is the expectation
  Eigen::Vector2d new_px = Eigen::Vector2d::Zero();
  bool used = false;
};

struct RecalibrationResult {
  Code code = Code::internal;
  std::string reason;                           // one sentence with the numbers, empty when ok
  Pose X_CoCn = Pose::Identity();               // the new camera in the old camera's frame
  Pose X_WCn = Pose::Identity();                // X_WCo * X_CoCn
  bool translation_known = false;               // arbitrary points: it is neglected, its covariance is zero
  Matrix6 covariance = Matrix6::Zero();         // of the delta in moved(X_WCn): mm, rad, axes of W
  Matrix6 change_covariance = Matrix6::Zero();  // of the delta in moved(X_CoCn): axes of Co
  double sigma_px = 0;  // of one coordinate: as given, from the residuals, or 0.1 where there is neither
  double rms_px = 0;    // root of the mean squared distance of the pixels used
  int redundancy = 0;
  std::vector<RecalibrationDeviation> deviations;  // in the order of the points, where there is an estimate
  std::vector<std::size_t> removed;                // points that moved themselves, worst first
  std::vector<std::size_t> suspects;               // deviation_not_attributable: one of these
  std::vector<std::string> warnings;
};

// known_points (3 and more): maximum likelihood of the pose from the new pixels. Several poses that explain
// three points equally well are told apart by X_WCo.
// arbitrary_points (2 and more): unit(d_old) = R unit(d_new), maximum likelihood of the three angles with the
// covariances of both pixels. A translation t of the camera turns up as a wrong rotation of about t /
// distance. groups (2 and more of 3 points and more): maximum likelihood of the change (6) and of every
// group's pose in the old camera (6 each) from all old and new pixels. With the groups held where the old
// pixels alone put them (6 unknowns) the error of the old pixels would be taken for a movement; the bundle
// reaches the Cramer-Rao bound.
//
// A point that was itself moved is removed and named where the redundancy suffices: known points from 5 on,
// groups from 7 points on as a rule, arbitrary points from 4 on and only if the others agree on a pure
// rotation.
//
// Codes: marks_invalid (numbers that are none, a pixel outside the lens model's range), too_few_marks,
// geometry_degenerate (on a line, parallel directions, several answers), not_converged,
// deviation_not_attributable. Poses count only when the code is ok.
RecalibrationResult recalibrate(const RecalibrationProblem& problem);

}  // namespace zeropose
