// From discs in an image to those that form one grid, wherever on a board it may lie. Internal to the room.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <span>
#include <vector>

#include "measure/board_plane.h"
#include "measure/lattice.h"
#include "measure/marks.h"

namespace zeropose {

struct BoardGrid {
  std::vector<LatticePoint> points;  // into the discs
  std::optional<BoardPlane> plane;   // places are lattice coordinates; nothing when there is no grid
};

// Grows the lattice, then lets the plane decide: discs across a gap that lie on it join, discs that stand off
// it or have another size or shape than it says leave.
BoardGrid find_grid(std::span<const MarkFinding> discs, int width_px, int height_px);

}  // namespace zeropose
