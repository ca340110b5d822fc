// Best fit between two frames with the points' uncertainty: weighted, with its covariance, wrong points named
// (spec 30 A2, spec 40 P3 and stereo sensor).
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "calib/rigid.h"

namespace zeropose {

// A point as it is known in both frames, covariances along the axes of each.
struct MeasuredPair {
  Eigen::Vector3d p_A_mm = Eigen::Vector3d::Zero();
  Eigen::Vector3d p_B_mm = Eigen::Vector3d::Zero();
  Eigen::Matrix3d covariance_A_mm2 = Eigen::Matrix3d::Zero();
  Eigen::Matrix3d covariance_B_mm2 = Eigen::Matrix3d::Zero();  // one of both is positive definite
};

enum class FrameFitStatus {
  failed = 0,
  ok,
  wrong_problem,   // a number that is none, a covariance that is not positive
  too_few_points,  // fewer than three
  collinear,       // the points lie on a line
  contradiction,   // the points contradict each other and it is open which one is wrong
  not_converged
};
std::string_view name_of(FrameFitStatus status);

struct FrameFitResult {
  FrameFitStatus status = FrameFitStatus::failed;
  std::string reason;  // one sentence with the numbers, empty when ok
  Pose X_AB = Pose::Identity();
  Matrix6 covariance = Matrix6::Zero();       // of the delta in moved(), from the points' covariances
  std::vector<Eigen::Vector3d> residuals_mm;  // p_A - X_AB * p_B, in the order of the pairs
  double rms_mm = 0;                          // root of the mean squared distance over the points used
  int redundancy = 0;
  std::vector<std::size_t> removed;   // points that contradict the others, worst first
  std::vector<std::size_t> suspects;  // contradiction: one of these
};

// Maximum likelihood, the covariances of B turned by the pose. A wrong point is taken out as in
// remove_wrong_points(), which four points and more allow.
FrameFitResult fit_frames(std::span<const MeasuredPair> pairs);

// A pose with the covariance of the delta in moved().
struct UncertainPose {
  Pose X = Pose::Identity();
  Matrix6 covariance = Matrix6::Zero();
};

// X_AC = X_AB X_BC of two that were measured independently.
UncertainPose chain(const UncertainPose& X_AB, const UncertainPose& X_BC);

}  // namespace zeropose
