// Robot-world / hand-eye calibration: where a camera is on a robot's hand and a board in the robot's base, or
// a camera in the base and a board on the hand, both from views of the board at several poses of the hand
// (spec 40 P3).
#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "calib/calibration.h"
#include "calib/robot_poses.h"

namespace zeropose {

enum class HandEyeSetup { eye_in_hand, eye_to_hand };

struct HandEyeView {
  std::string name;
  Pose X_RH = Pose::Identity();
  std::vector<CalibrationPoint> points;  // p_W_mm and disc_normal_W are in the board's frame B
};

struct HandEyeProblem {
  CameraModel model;
  HandEyeSetup setup = HandEyeSetup::eye_to_hand;
  std::span<const HandEyeView> views;
  double sigma_px = 0;  // of one pixel coordinate, scales the covariances; 0: from the residuals
  // Of one component of the hand's pose, delta of moved(X_RH); both 0: from how the views disagree.
  double robot_sigma_mm = 0, robot_sigma_deg = 0;
  bool reject_wrong_views = true;
};

enum class HandEyeStatus {
  failed = 0,
  ok,
  wrong_problem,     // a sigma or a number that is none
  too_few_views,     // fewer than 3 in which the board's pose was found
  rotation_missing,  // the hand's turns leave a direction open
  contradiction,     // robot and pictures contradict each other and it is open why
  not_converged
};
std::string_view name_of(HandEyeStatus status);

struct HandEyeViewResult {
  bool used = false;
  std::string reason;                       // why not
  Pose X_CB = Pose::Identity();             // from this view alone
  std::size_t points_used = 0;              // the others contradict them
  std::vector<std::size_t> points_removed;  // those others
  // Where this view alone puts the board beside where robot and estimate put it; infinite without a pose.
  double error_mm = 0, error_deg = 0;
  double rms_px = 0;  // of the joint estimate
};

struct HandEyeResult {
  HandEyeStatus status = HandEyeStatus::failed;
  std::string reason;            // one sentence with the numbers, empty when ok
  Pose X_FC = Pose::Identity();  // of the camera: X_HC (eye in hand) or X_RC
  Pose X_GB = Pose::Identity();  // of the board: X_RB or X_HB
  Matrix6 covariance_FC = Matrix6::Zero(), covariance_GB = Matrix6::Zero();  // of the deltas of moved()
  double sigma_px = 0;  // of one coordinate: as given, or from the residuals in the views
  double robot_sigma_mm = 0, robot_sigma_deg = 0;  // as given, or estimated
  // What the covariances were multiplied with because the robot's noise is estimated from few views, so that
  // 95 % ellipsoids hold (few_data_factor()); 1 where it was given.
  double few_views_factor = 1;
  double rms_px = 0;  // root of the mean squared point distance from the joint estimate, views used
  double rms_mm = 0, rms_deg = 0;  // of the views' errors, views used
  double scale = 1,
         scale_sigma = 0;  // by which the board's coordinates would fit better: a diagnosis, not applied
  int redundancy = 0;      // six for each view used, less twelve
  HandTurns turns;
  std::vector<HandEyeViewResult> views;  // in the order of the problem's
  std::vector<std::size_t> removed;      // views that contradict the others, worst first
  std::vector<std::size_t> suspects;     // contradiction: one of these
  std::vector<std::string> warnings;
};

// Eye to hand X_RHi X_HB = X_RC X_CBi, eye in hand X_RHi X_HC X_CBi = X_RB for all views. X_CB of each view
// from its points; rotations in closed form (Shah, "Solving the robot-world/hand-eye calibration problem
// using the Kronecker product", 2013), translations linear; views that contradict the others are taken out;
// then both poses together by least squares of the reprojection errors, whose covariance in a view is that of
// the pixels and of the robot's pose. The robot's noise is estimated along (restricted maximum likelihood)
// unless it is given.
HandEyeResult calibrate_hand_eye(const HandEyeProblem& problem);

}  // namespace zeropose
