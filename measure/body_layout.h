// The planes of a calibration body and the parallelograms of neighbours on them. Internal to the room.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <span>
#include <vector>

#include "measure/body.h"

namespace zeropose {

// Four neighbours in the order round the parallelogram: corner, first side, across, second side.
using BodyCell = std::array<std::size_t, 4>;

struct BodyPlane {
  std::vector<std::size_t> marks;
  std::vector<Eigen::Vector2d> places;  // of the marks in the plane, mm
  Eigen::Vector3d origin_B = Eigen::Vector3d::Zero();
  Eigen::Matrix3d axes_B = Eigen::Matrix3d::Identity();  // columns: the plane's x, y and normal
  std::vector<BodyCell> cells;                           // into `marks`, turning from x to y
};

struct BodyLayout {
  std::vector<BodyPlane> planes;
  std::vector<double> spacing_mm;          // of each mark: to its nearest neighbour
  std::vector<Eigen::Vector3d> normals_B;  // unit; zero: of a mark on no plane
};

// Greedy, the plane with most marks first: all marks within a twentieth of the spacing of the plane through
// three neighbours. Normals that are given win over those of the layout, whose sign is open.
BodyLayout layout_of(std::span<const BodyMark> marks);

// All parallelograms of neighbours among points with no other point in them, each once, turning from x to y.
// metric: per point, turns offsets into lengths that can be compared in all directions.
std::vector<BodyCell> cells_of(std::span<const Eigen::Vector2d> points,
                               std::span<const Eigen::Matrix2d> metric);

}  // namespace zeropose
