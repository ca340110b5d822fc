// Where on its board a grid lies: every way in which the found places fit it. Internal to the room.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <span>
#include <vector>

#include "measure/board.h"

namespace zeropose {

// Quarter turns and a shift: from lattice coordinates to coordinates on the board in units of the pitch (x
// along the columns).
struct BoardReading {
  Eigen::Matrix2i turn = Eigen::Matrix2i::Identity();
  Eigen::Vector2i shift = Eigen::Vector2i::Zero();

  Eigen::Vector2i on_board(const Eigen::Vector2i& lattice) const { return turn * lattice + shift; }
  // The lattice coordinates of a place on the board (not whole numbers where no lattice point is).
  Eigen::Vector2d in_lattice(const Eigen::Vector2i& board) const;
};

// Coordinates in units of the pitch, and back: nothing where the board has no circle.
Eigen::Vector2i board_units(BoardKind kind, const BoardIndex& at);
std::optional<BoardIndex> board_index(const BoardProblem& problem, const Eigen::Vector2i& units);

struct BoardReadings {
  std::vector<BoardReading> best;  // those in which the fewest places lie beside the board
  std::size_t beside = 0;          // how many do
  bool equivalent = false;         // the board looks the same in all of the best ones
};

// Never mirrored.
BoardReadings read_board(const BoardProblem& problem, std::span<const Eigen::Vector2i> lattice);

}  // namespace zeropose
