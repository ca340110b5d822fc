// Tables of measured points as verbs write them for each other: point [role] x_mm y_mm z_mm.
#pragma once

#include <Eigen/Core>
#include <span>
#include <string>

namespace zeropose::cli {

struct TablePoint {
  std::string name, role;  // role: as zeropose frame reads it, empty: none
  Eigen::Vector3d p_mm = Eigen::Vector3d::Zero();
};

// With the column role where `roles` says so.
std::string point_table(std::span<const TablePoint> points, bool roles);

}  // namespace zeropose::cli
