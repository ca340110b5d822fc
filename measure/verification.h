// Points of the object that another measuring system measured, held against where a cell believes them to be
// (spec 92, verify).
#pragma once

#include <Eigen/Core>
#include <span>
#include <string>
#include <vector>

#include "calib/rigid.h"

namespace zeropose {

struct VerificationPoint {
  std::string name;
  Eigen::Vector3d p_O_mm = Eigen::Vector3d::Zero();  // as drawn
  Eigen::Vector3d compensation_O_mm = Eigen::Vector3d::Zero();
  Eigen::Vector3d measured_W_mm = Eigen::Vector3d::Zero();
};

struct VerificationError {
  // Measured minus X_WO p_O. By the drawn place, and with the mark's compensation.
  Eigen::Vector3d error_W_mm = Eigen::Vector3d::Zero(), compensated_W_mm = Eigen::Vector3d::Zero();
};

struct Verification {
  bool ok = false;     // every point within the limit
  std::string reason;  // one sentence with the numbers, empty when ok
  std::vector<VerificationError> errors;
  std::size_t worst = 0;
  double worst_mm = 0, rms_mm = 0;
  Eigen::Vector3d mean_W_mm = Eigen::Vector3d::Zero();  // what all points have in common
};

// The verdict is about the drawn places: the robot works at application points, which have no compensation,
// so it is the pose that must be right. A compensation also takes up what is wrong with a camera; with it a
// mark would look right where the cell sees it, which is not the question. The compensated error beside it
// tells a mark that is off the drawing from a pose that is wrong. Preconditions: points, a limit above 0.
Verification verify(const Pose& X_WO, std::span<const VerificationPoint> points, double max_mm);

}  // namespace zeropose
