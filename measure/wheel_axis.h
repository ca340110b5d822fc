// The axis of a surface of revolution, from points on radial lines of a tyre's side wall. Internal to the
// room.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <span>
#include <vector>

namespace zeropose {

struct WheelAxis {
  Eigen::Vector3d p_W_mm = Eigen::Vector3d::Zero();  // a point of it
  Eigen::Vector3d n_W = Eigen::Vector3d::UnitZ();    // unit vector

  struct Place {
    double radius_mm = 0, height_mm = 0;
    Eigen::Vector3d outwards_W = Eigen::Vector3d::Zero();
  };
  Place place(const Eigen::Vector3d& p_W) const;
};

// A point of the side wall in W.
struct SidePoint {
  Eigen::Vector3d p_W_mm = Eigen::Vector3d::Zero();
  // By how much it moves with one sigma of the left pixel and of the right one.
  Eigen::Vector3d by_left_mm = Eigen::Vector3d::Zero(), by_right_mm = Eigen::Vector3d::Zero();

  double sigma_along(const Eigen::Vector3d& n) const;  // mm
};
using SideLine = std::vector<SidePoint>;

// The axis about which all lines show the same section, letters and dirt thrown out by Cauchy's loss, from a
// start within 5 degrees and 25 mm (Gauss-Newton; the section is a spline, with few knots at first).
// Nothing where the lines do not determine it or the steps do not settle.
std::optional<WheelAxis> fit_axis(std::span<const SideLine> lines, const WheelAxis& start);

}  // namespace zeropose
