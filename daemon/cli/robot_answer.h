// What the calibrations with a robot answer alike: covariances, sigmas, warnings.
#pragma once

#include "calib/robot_poses.h"
#include "daemon/cli/answer.h"

namespace zeropose::cli {

template <typename Matrix>
Json rows_json(const Matrix& matrix) {
  Json rows = Json::array();
  for (Eigen::Index row = 0; row < matrix.rows(); ++row)
    rows.push_back(json_of(Eigen::VectorXd(matrix.row(row).transpose())));
  return rows;
}

// Of six numbers: mm along and degrees about the axes of the outer frame.
inline Vector6 sigma_of(const Matrix6& covariance) {
  Vector6 sigma = covariance.diagonal().cwiseSqrt();
  sigma.tail<3>() *= degrees_per_radian;
  return sigma;
}

// About which the answer is open.
inline void add_open_axes(const HandTurns& turns, Json& json) {
  json["open_axis_R"] = json_of(turns.axis_R);
  json["open_axis_H"] = json_of(turns.axis_H);
}

inline std::string warnings_text(const std::vector<std::string>& warnings) {
  std::string text;
  for (const std::string& warning : warnings) text += "warning: " + warning + "\n";
  return text;
}

}  // namespace zeropose::cli
