#include "calib/uncertainty.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

namespace zeropose {
namespace {

using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector3d;

constexpr Eigen::Index count = parameter_count, first_position = static_cast<Eigen::Index>(Parameter::x),
                       first_angle = static_cast<Eigen::Index>(Parameter::rx);

// Turns per angle: the columns are the world axes about which rx, ry and rz turn, R = Rz Ry Rx.
Matrix3d turns_per_angle(const Pose& X_WC) {
  const SixNumbers six = to_six_numbers(X_WC);
  const double ry = six.ry_deg / degrees_per_radian, rz = six.rz_deg / degrees_per_radian;
  Matrix3d turns;
  turns << std::cos(ry) * std::cos(rz), -std::sin(rz), 0,  //
      std::cos(ry) * std::sin(rz), std::cos(rz), 0,        //
      -std::sin(ry), 0, 1;
  return turns;
}

bool has(const ParameterCovariance& uncertainty, Parameter parameter) {
  const auto& all = uncertainty.parameters;
  return std::find(all.begin(), all.end(), parameter) != all.end();
}

// What the estimates' covariance refers to -> what is reported, rad still.
MatrixXd jacobian(const ParameterCovariance& uncertainty, const Pose& X_WC, double offset_mm) {
  const Matrix3d turns = turns_per_angle(X_WC);
  const bool about_axes = has(uncertainty, Parameter::rx) && has(uncertainty, Parameter::ry) &&
                          has(uncertainty, Parameter::rz);  // else the six numbers' angles already
  const Matrix3d by_axes = about_axes ? Matrix3d::Identity() : turns;
  MatrixXd J = MatrixXd::Identity(count, count);
  // The frame's new origin is off_W away: it moves by turn x off_W.
  const Vector3d off_W = X_WC.linear().col(2) * offset_mm;
  J.block<3, 3>(first_position, first_angle) = -cross_matrix(off_W) * by_axes;
  if (about_axes && std::abs(turns.determinant()) > 1e-3)
    J.block<3, 3>(first_angle, first_angle) = turns.inverse();
  return J;
}

}  // namespace

Pose with_frame_offset(const Pose& X_WC, double frame_offset_z_mm) {
  Pose X_CF = Pose::Identity();
  X_CF.translation().z() = frame_offset_z_mm;
  return X_WC * X_CF;
}

ReportedUncertainty reported_uncertainty(const ParameterCovariance& uncertainty, const Pose& X_WC,
                                         double frame_offset_z_mm) {
  ReportedUncertainty reported;
  const auto& free = uncertainty.parameters;
  if (free.empty()) return reported;
  MatrixXd full = MatrixXd::Zero(count, count);
  for (std::size_t i = 0; i < free.size(); ++i)
    for (std::size_t j = 0; j < free.size(); ++j)
      full(static_cast<Eigen::Index>(free[i]), static_cast<Eigen::Index>(free[j])) =
          uncertainty.covariance(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j));
  const MatrixXd J = jacobian(uncertainty, X_WC, frame_offset_z_mm);
  full = (J * full * J.transpose()).eval();
  for (Eigen::Index i = 0; i < count; ++i)
    if (has(uncertainty, static_cast<Parameter>(i)) || full(i, i) > 0)
      reported.parameters.push_back(static_cast<Parameter>(i));
  const auto n = static_cast<Eigen::Index>(reported.parameters.size());
  const auto at = [&](Eigen::Index i) {
    return static_cast<Eigen::Index>(reported.parameters[static_cast<std::size_t>(i)]);
  };
  reported.sigma.resize(n);
  reported.correlation.resize(n, n);
  for (Eigen::Index i = 0; i < n; ++i) {
    reported.sigma(i) = std::sqrt(full(at(i), at(i))) * (at(i) >= first_angle ? degrees_per_radian : 1);
    for (Eigen::Index j = 0; j < n; ++j) {
      const double product = std::sqrt(full(at(i), at(i)) * full(at(j), at(j)));
      reported.correlation(i, j) = i == j ? 1 : (product > 0 ? full(at(i), at(j)) / product : 0);
    }
  }
  return reported;
}

double sigma_of(const ReportedUncertainty& uncertainty, Parameter parameter) {
  for (std::size_t i = 0; i < uncertainty.parameters.size(); ++i)
    if (uncertainty.parameters[i] == parameter) return uncertainty.sigma(static_cast<Eigen::Index>(i));
  return -1;
}

}  // namespace zeropose
