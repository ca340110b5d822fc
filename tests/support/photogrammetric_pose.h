// Exterior orientations as photogrammetry publishes them.
#pragma once

#include "calib/rigid.h"
#include "tests/support/csv.h"

namespace zeropose::test {

// Columns omega_deg phi_deg kappa_deg Xc_m Yc_m Zc_m: R = R3(kappa) R2(phi) R1(omega), turns of the frame;
// their camera looks along its -z.
inline Pose photogrammetric_pose(const CsvTable& table, std::size_t row) {
  const auto turn = [&](const char* name, const Eigen::Vector3d& axis) {
    return Eigen::AngleAxisd(-table.number(row, name) / degrees_per_radian, axis).toRotationMatrix();
  };
  Pose X_WC = Pose::Identity();
  X_WC.linear() = (Eigen::Vector3d(1, -1, -1).asDiagonal() * turn("kappa_deg", Eigen::Vector3d::UnitZ()) *
                   turn("phi_deg", Eigen::Vector3d::UnitY()) * turn("omega_deg", Eigen::Vector3d::UnitX()))
                      .transpose();
  X_WC.translation() =
      1000 * Eigen::Vector3d(table.number(row, "Xc_m"), table.number(row, "Yc_m"), table.number(row, "Zc_m"));
  return X_WC;
}

}  // namespace zeropose::test
