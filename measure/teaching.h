// Teaching a new object: the places of its marks in its own frame, from what a stereo sensor measures at one
// or several positions (spec 50 M2).
#pragma once

#include <Eigen/Core>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "calib/rigid.h"
#include "measure/code.h"

namespace zeropose {

// A mark as the sensor measured it at one of its positions: triangulate() with the cameras' poses in S.
struct SensedMark {
  std::string mark;
  std::size_t position = 0;  // index into TeachingProblem::X_WS
  Eigen::Vector3d p_S_mm = Eigen::Vector3d::Zero();
  Eigen::Matrix3d covariance_mm2 = Eigen::Matrix3d::Identity();  // axes of S
};

struct TeachingProblem {
  std::span<const Pose> X_WS;  // of the sensor at each position; on a robot's hand X_RH X_HS
  std::span<const SensedMark> sensed;
  std::optional<Pose> X_WO;      // none: the object's frame is that of the sensor at the first position
  double position_sigma_mm = 0;  // of X_WS at a mark, per axis: what robot and hand calibration add
};

struct TaughtMark {
  std::string mark;
  Eigen::Vector3d p_O_mm = Eigen::Vector3d::Zero();
  Eigen::Matrix3d covariance_mm2 = Eigen::Matrix3d::Zero();  // axes of O
  int positions = 0;                                         // from which it was seen
  double spread_mm = 0;                                      // its largest distance from this mean
};

struct TeachingResult {
  Code code = Code::internal;
  std::string reason;  // one sentence with the numbers, empty when ok
  Pose X_WO = Pose::Identity();
  std::vector<TaughtMark> marks;  // in the order in which they first appear
};

// p_O = X_WO^-1 X_WS p_S; a mark that was seen from several positions is their mean, weighted with the
// inverse covariances.
//
// Codes: marks_invalid (no mark, an index out of range, a number that is none, a covariance that is not
// positive, a mark twice at one position), deviation_not_attributable (a mark was seen at places further
// apart than their covariances allow, 0.1 % false alarm; the worst one is named, and all are listed). The
// marks count only when the code is ok.
TeachingResult teach(const TeachingProblem& problem);

}  // namespace zeropose
