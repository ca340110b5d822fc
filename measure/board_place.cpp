#include "measure/board_place.h"

#include <Eigen/LU>
#include <algorithm>
#include <limits>

namespace zeropose {
namespace {

using Eigen::Matrix2i;
using Eigen::Vector2d;
using Eigen::Vector2i;

Vector2i extent_of(const BoardProblem& problem) {
  const bool zigzag = problem.kind == BoardKind::asymmetric_circles;
  return {zigzag ? 2 * problem.cols : problem.cols, problem.rows};
}

// From the square lattice to the board's axes: rows of a zigzag run along the lattice's diagonals.
Matrix2i axes_of(BoardKind kind) {
  Matrix2i axes = Matrix2i::Identity();
  if (kind == BoardKind::asymmetric_circles) axes << 1, -1, 1, 1;
  return axes;
}

Matrix2i quarter_turns(int count) {
  Matrix2i turn = Matrix2i::Identity(), quarter;
  quarter << 0, -1, 1, 0;
  for (int k = 0; k < count; ++k) turn = quarter * turn;
  return turn;
}

struct Box {
  Vector2i low = Vector2i::Constant(std::numeric_limits<int>::max());
  Vector2i high = Vector2i::Constant(std::numeric_limits<int>::min());
};

Box box_of(std::span<const Vector2i> lattice, const Matrix2i& turn) {
  Box box;
  for (const Vector2i& at : lattice) {
    box.low = box.low.cwiseMin(turn * at);
    box.high = box.high.cwiseMax(turn * at);
  }
  return box;
}

// Stops counting when it is more than of interest.
std::size_t count_beside(const BoardProblem& problem, std::span<const Vector2i> lattice,
                         const BoardReading& reading, std::size_t of_interest) {
  std::size_t beside = 0;
  for (const Vector2i& at : lattice) {
    if (!board_index(problem, reading.on_board(at)) && ++beside > of_interest) break;
  }
  return beside;
}

// All shifts of one turn in which grid and board overlap.
void read_turned(const BoardProblem& problem, std::span<const Vector2i> lattice, const Matrix2i& turn,
                 BoardReadings& readings) {
  const Box box = box_of(lattice, turn);
  const Vector2i first = -box.high, last = extent_of(problem) - Vector2i(1, 1) - box.low;
  for (int y = first.y(); y <= last.y(); ++y) {
    for (int x = first.x(); x <= last.x(); ++x) {
      const BoardReading reading{turn, {x, y}};
      const std::size_t beside = count_beside(problem, lattice, reading, readings.beside);
      if (beside > readings.beside) continue;
      if (beside < readings.beside) readings.best.clear();
      readings.beside = beside;
      readings.best.push_back(reading);
    }
  }
}

// The change from one reading to the other carries the board onto itself.
bool same_board(const BoardProblem& problem, const BoardReading& a, const BoardReading& b) {
  for (int row = 0; row < problem.rows; ++row) {
    for (int col = 0; col < problem.cols; ++col) {
      const Vector2i at = board_units(problem.kind, {row, col});
      const Vector2d moved = b.turn.cast<double>() * a.in_lattice(at) + b.shift.cast<double>();
      if (!board_index(problem, moved.array().round().cast<int>())) return false;
    }
  }
  return true;
}

}  // namespace

Vector2d BoardReading::in_lattice(const Vector2i& board) const {
  return turn.cast<double>().inverse() * (board - shift).cast<double>();
}

Vector2i board_units(BoardKind kind, const BoardIndex& at) {
  return {kind == BoardKind::asymmetric_circles ? 2 * at.col + at.row % 2 : at.col, at.row};
}

std::optional<BoardIndex> board_index(const BoardProblem& problem, const Vector2i& units) {
  const Vector2i extent = extent_of(problem);
  if (units.minCoeff() < 0 || units.x() >= extent.x() || units.y() >= extent.y()) return std::nullopt;
  if (problem.kind != BoardKind::asymmetric_circles) return BoardIndex{units.y(), units.x()};
  if ((units.x() - units.y()) % 2 != 0) return std::nullopt;
  return BoardIndex{units.y(), units.x() / 2};
}

BoardReadings read_board(const BoardProblem& problem, std::span<const Vector2i> lattice) {
  BoardReadings readings;
  readings.beside = lattice.size();
  for (int count = 0; count < 4; ++count)
    read_turned(problem, lattice, quarter_turns(count) * axes_of(problem.kind), readings);
  readings.equivalent = !readings.best.empty() &&
                        std::all_of(readings.best.begin(), readings.best.end(), [&](const BoardReading& b) {
                          return same_board(problem, readings.best.front(), b);
                        });
  return readings;
}

}  // namespace zeropose
