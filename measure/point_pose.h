// The pose of an object from the measured places of its points (spec 50 M2).
#pragma once

#include <Eigen/Core>
#include <span>
#include <string>
#include <vector>

#include "calib/rigid.h"
#include "measure/code.h"

namespace zeropose {

// A point of the object and where it was measured in frame A: the world, or a stereo sensor.
struct MeasuredPoint {
  Eigen::Vector3d p_O_mm = Eigen::Vector3d::Zero();
  Eigen::Vector3d p_A_mm = Eigen::Vector3d::Zero();
  Eigen::Matrix3d covariance_mm2 = Eigen::Matrix3d::Identity();  // of p_A, axes of A
};

struct PointPose {
  Code code = Code::internal;
  std::string reason;  // one sentence, empty when ok
  Pose X_AO = Pose::Identity();
  Matrix6 covariance = Matrix6::Zero();  // of the delta in moved(): mm, rad, axes of A, about O's origin
  std::vector<Eigen::Vector3d> deviations_mm;  // p_A - X_AO p_O, one per point
};

// Best fit (spec 30 A2) with the reciprocal of each point's mean variance as its weight. A best fit knows one
// variance per point, a stereo point has three, the depth's the largest by far; the covariance is that of
// this estimate with the points' own covariances C: N^-1 (sum w^2 J' C J) N^-1. Where the pixels are at hand
// estimate_pose() over all cameras is the better way: it weighs every direction as it was seen, which makes
// it the most likely pose and its sigma the smallest one possible.
//
// Codes: marks_invalid (a number that is none, a covariance that is not positive), too_few_marks (fewer than
// three), geometry_degenerate (on a line).
PointPose pose_of_points(std::span<const MeasuredPoint> points);

}  // namespace zeropose
