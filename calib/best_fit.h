// Best fit between two frames: the rigid pose that carries points of B onto the same points of A (spec 30
// A2).
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "calib/rigid.h"

namespace zeropose {

struct PointPair {
  Eigen::Vector3d p_A_mm = Eigen::Vector3d::Zero();
  Eigen::Vector3d p_B_mm = Eigen::Vector3d::Zero();
  double weight = 1;  // of the squared distance, >= 0
};

enum class BestFitStatus { failed = 0, ok, too_few_points, collinear, not_finite };

struct BestFitResult {
  BestFitStatus status = BestFitStatus::failed;
  Pose X_AB = Pose::Identity();
  std::vector<Eigen::Vector3d> residuals_mm;  // p_A - X_AB * p_B, one per pair
  double rms_mm = 0;                          // root of the weighted mean squared distance
  double sigma_mm = 0;  // of one coordinate of weight 1, from the residuals; 0 where they are exact
  Matrix6 covariance = Matrix6::Zero();  // of the delta in moved(): mm, rad; scaled with sigma_mm
};

// Closed form by SVD (Umeyama 1991 without scale). Needs three points of positive weight that are not
// collinear.
BestFitResult best_fit(std::span<const PointPair> pairs);

}  // namespace zeropose
