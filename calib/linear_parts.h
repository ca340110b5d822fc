// What the linear methods share. Internal to the room.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "calib/linear_methods.h"

namespace zeropose::linear {

// The solution of A x = 0 with |x| = 1: the right singular vector of the least singular value.
struct NullVector {
  Eigen::VectorXd x;
  double condition = 0;  // largest by second least singular value: infinite when x is not unique
};
NullVector null_vector(const Eigen::MatrixXd& A);

// The least-squares solution of A x = b with the columns scaled to unit length.
struct LeastSquares {
  Eigen::VectorXd x;
  Eigen::VectorXd sigma;  // from the residuals
  double condition = 0;
};
LeastSquares least_squares(const Eigen::MatrixXd& A, const Eigen::VectorXd& b);

// Points about their centroid.
struct Centred {
  std::vector<Eigen::Vector3d> p_mm;
  Eigen::Vector3d centroid_mm = Eigen::Vector3d::Zero();
};
Centred centred(std::span<const CalibrationPoint> points);

// Depths of the points; both signs, or none but negative ones, are an error of the correspondences.
bool all_in_front(std::span<const CalibrationPoint> points, const Pose& X_WC);
LinearResult failure(CalibrationStatus status, std::string reason, double condition = 0);

// X_WC from p_C = R (p_W - centroid) + t.
Pose pose_from(const Eigen::Matrix3d& R_CW, const Eigen::Vector3d& t_C, const Eigen::Vector3d& centroid);

inline constexpr double largest_condition = 1e10;

}  // namespace zeropose::linear
