#include "measure/chessboard.h"

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <optional>
#include <tuple>
#include <utility>

#include "calib/words.h"
#include "measure/chessboard_corners.h"
#include "measure/saddle_fit.h"

namespace zeropose {
namespace {

using Eigen::Vector2d;
using Eigen::Vector2i;

// Corners of the whole board in some order of rows and columns that OpenCV chose.
struct Corners {
  int rows = 0, cols = 0;
  std::vector<Vector2d> at_px;
  std::vector<SaddleFit> fits;

  std::size_t index(int row, int col) const {
    return std::size_t(row) * std::size_t(cols) + std::size_t(col);
  }
  // Along a column step or row step, from the neighbours there are.
  Vector2d step(int row, int col, int by_row, int by_col) const {
    const auto inside = [this](int r, int c) { return r >= 0 && c >= 0 && r < rows && c < cols; };
    const bool after = inside(row + by_row, col + by_col), before = inside(row - by_row, col - by_col);
    const Vector2d& a = at_px[after ? index(row + by_row, col + by_col) : index(row, col)];
    const Vector2d& b = at_px[before ? index(row - by_row, col - by_col) : index(row, col)];
    return (a - b) / ((after ? 1 : 0) + (before ? 1 : 0));
  }
};

std::optional<Corners> corners_from(ChessboardCorners found) {
  if (found.at_px.empty()) return std::nullopt;
  return Corners{found.rows, found.cols, std::move(found.at_px), {}};
}

// A part must fit into the board one way or the other, and be enough of it.
std::optional<Corners> detect_part(const ImageView& image, const BoardProblem& problem) {
  std::optional<Corners> part = corners_from(part_of_chessboard(image));
  if (!part) return std::nullopt;
  const auto [less, more] = std::minmax(part->rows, part->cols);
  const auto [rows, cols] = std::minmax(problem.rows, problem.cols);
  const bool enough = part->rows * part->cols >= problem.least_share * problem.rows * problem.cols;
  return less <= rows && more <= cols && enough ? part : std::nullopt;
}

// How many corners could not be measured.
std::size_t measure(const ImageView& image, Corners& corners) {
  std::size_t failed = 0;
  for (int row = 0; row < corners.rows; ++row) {
    for (int col = 0; col < corners.cols; ++col) {
      SaddleStart start{corners.at_px[corners.index(row, col)], {}};
      start.steps_px << corners.step(row, col, 0, 1), corners.step(row, col, 1, 0);
      corners.fits.push_back(fit_saddle(image, start));
      failed += corners.fits.back().converged ? 0 : 1;
    }
  }
  return failed;
}

// One way to count: from which corner, and whether rows and columns change places.
struct Reading {
  bool from_last_row = false, from_last_col = false, swapped = false;

  // Row and column in OpenCV's order.
  Vector2i source(const Corners& c, const BoardIndex& at) const {
    const int row = swapped ? at.col : at.row, col = swapped ? at.row : at.col;
    return {from_last_row ? c.rows - 1 - row : row, from_last_col ? c.cols - 1 - col : col};
  }
};

struct Rank {
  bool light;  // the square outside the first corner
  double distance_px;
  bool operator<(const Rank& other) const {
    return std::tie(light, distance_px) < std::tie(other.light, other.distance_px);
  }
};

const SaddleFit& fit_at(const Corners& corners, const Reading& reading, const BoardIndex& at) {
  const Vector2i source = reading.source(corners, at);
  return corners.fits[corners.index(source.x(), source.y())];
}

bool right_handed(const Corners& corners, const Reading& reading) {
  const Vector2d o = fit_at(corners, reading, {0, 0}).u_px;
  Eigen::Matrix2d axes;
  axes << fit_at(corners, reading, {0, 1}).u_px - o, fit_at(corners, reading, {1, 0}).u_px - o;
  return axes.determinant() > 0;
}

// The step of a fit belongs to the squares at the even corners of OpenCV's order: inner and outer ones of a
// corner at opposite angles are alike. A reading that starts from one end only sees the other two squares.
Rank rank_of(const Corners& corners, const Reading& reading) {
  const SaddleFit& first = fit_at(corners, reading, {0, 0});
  const bool mirrored = reading.from_last_row != reading.from_last_col;
  return {(mirrored ? -first.step_grey : first.step_grey) > 0, first.u_px.norm()};
}

BoardResult listed(const BoardProblem& problem, const Corners& corners) {
  std::vector<std::pair<Rank, Reading>> readings;
  for (int k = 0; k < 8; ++k) {
    const Reading reading{(k & 1) != 0, (k & 2) != 0, (k & 4) != 0};
    if ((reading.swapped && problem.rows != problem.cols) || !right_handed(corners, reading)) continue;
    readings.emplace_back(rank_of(corners, reading), reading);
  }
  BoardResult result;
  if (readings.empty()) return result;
  const auto best = std::min_element(readings.begin(), readings.end(),
                                     [](const auto& a, const auto& b) { return a.first < b.first; });
  result.status = BoardStatus::found;
  result.place_known = true;
  result.equivalent_readings = static_cast<int>(std::count_if(
      readings.begin(), readings.end(), [&](const auto& r) { return r.first.light == best->first.light; }));
  for (int row = 0; row < problem.rows; ++row) {
    for (int col = 0; col < problem.cols; ++col) {
      const SaddleFit& fit = fit_at(corners, best->second, {row, col});
      const BoardIndex at{row, col};
      if (fit.converged)
        result.points.push_back({at, place_on_board(problem, at), fit.u_px, fit.covariance_px2, 0});
      else
        result.missing.push_back(at);
    }
  }
  return result;
}

}  // namespace

BoardResult find_chessboard(const ImageView& image, const BoardProblem& problem) {
  BoardResult result;
  BoardProblem seen = problem;  // the board, or the part of it that is seen
  std::optional<Corners> corners = corners_from(chessboard_corners(image, problem.rows, problem.cols));
  const bool part = !corners && problem.partial;
  if (part) corners = detect_part(image, problem);
  const std::string wanted =
      number(problem.rows) + " x " + number(problem.cols) + " inner corners (rows x columns)";
  if (!corners) {
    result.status = BoardStatus::no_grid;
    result.reason = "found no chessboard of " + wanted +
                    ": all of it must be in the image with a light border round it (or a part, if that is "
                    "allowed), and the corners are counted, "
                    "not the squares";
    return result;
  }
  seen.rows = corners->rows;
  seen.cols = corners->cols;
  const std::size_t failed = measure(image, *corners);
  const std::size_t count = corners->fits.size();
  if (double(count - failed) < problem.least_share * double(count)) {
    result.status = BoardStatus::too_few;
    result.reason = "found a chessboard, but " + number(failed) + " of its " + wanted +
                    " could not be measured: squares too small or not sharp";
    return result;
  }
  for (SaddleFit& fit : corners->fits)
    if (!fit.converged) fit.u_px = corners->at_px[std::size_t(&fit - corners->fits.data())];
  result = listed(seen, *corners);
  if (part && result.status == BoardStatus::found) {
    result.place_known = false;
    result.reason = "found " + number(seen.rows) + " x " + number(seen.cols) + " of the " + wanted +
                    "; which ones is not known";
  }
  if (failed > 0 && !part) result.reason = number(failed) + " of the " + wanted + " could not be measured";
  return result;
}

}  // namespace zeropose
