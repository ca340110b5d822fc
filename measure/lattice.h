// Which discs of an image stand on a square lattice on a plane. Internal to the room.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <span>
#include <vector>

namespace zeropose {

// The image of a disc: its outline is (x - u)^T shape^-1 (x - u) = 1.
struct LatticeDisc {
  Eigen::Vector2d u_px = Eigen::Vector2d::Zero();
  Eigen::Matrix2d shape_px2 = Eigen::Matrix2d::Identity();
};

struct LatticePoint {
  std::size_t disc = 0;  // index into the discs
  Eigen::Vector2i at = Eigen::Vector2i::Zero();
};

// The largest set of discs that hang together as neighbours on a lattice of squares; empty when there is none
// of at least four. The discs have equal size on the plane, so that an outline tells the plane's local
// stretch: seen through it, the neighbours of a disc form a square, however much the plane is tilted. The
// second axis is a quarter turn from the first in the sense from u to v. Gaps are bridged only where a way
// round them exists.
std::vector<LatticePoint> grow_lattice(std::span<const LatticeDisc> discs);

}  // namespace zeropose
