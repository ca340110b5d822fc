#include "measure/board.h"

#include <cmath>

#include "calib/words.h"
#include "measure/board_circles.h"
#include "measure/board_place.h"
#include "measure/chessboard.h"

namespace zeropose {
namespace {

constexpr int most_lines = 1000;  // rows or columns

// Empty when all is well.
std::string wrong_with(const BoardProblem& problem) {
  const int least = problem.kind == BoardKind::chessboard ? 3 : 2;
  if (problem.rows < least || problem.cols < least || problem.rows > most_lines || problem.cols > most_lines)
    return "a board of " + number(problem.rows) + " x " + number(problem.cols) +
           " (rows x columns): both must be " + number(least) + " to " + number(most_lines);
  if (!(problem.pitch_mm > 0) || !std::isfinite(problem.pitch_mm)) return "the pitch must be above 0 mm";
  if (!(problem.min_diameter_px >= 3) || !std::isfinite(problem.min_diameter_px))
    return "the least diameter must be at least 3 px";
  if (!(problem.min_axis_ratio > 0 && problem.min_axis_ratio <= 1))
    return "the least axis ratio must lie between 0 and 1";
  if (!(problem.min_contrast > 0)) return "the least contrast must be above 0";
  if (!(problem.least_share >= 0 && problem.least_share <= 1))
    return "the least share must lie between 0 and 1";
  return {};
}

BoardResult refusal(BoardStatus status, std::string reason) {
  BoardResult result;
  result.status = status;
  result.reason = std::move(reason);
  return result;
}

}  // namespace

std::string_view name_of(BoardKind kind) {
  switch (kind) {
    case BoardKind::circles:
      return "circles";
    case BoardKind::asymmetric_circles:
      return "asymmetric-circles";
    case BoardKind::chessboard:
      return "chessboard";
  }
  return "unknown";
}

std::string_view name_of(BoardStatus status) {
  switch (status) {
    case BoardStatus::failed:
      return "failed";
    case BoardStatus::found:
      return "found";
    case BoardStatus::wrong_problem:
      return "wrong_problem";
    case BoardStatus::empty_image:
      return "empty_image";
    case BoardStatus::no_grid:
      return "no_grid";
    case BoardStatus::too_few:
      return "too_few";
    case BoardStatus::wrong_size:
      return "wrong_size";
    case BoardStatus::ambiguous:
      return "ambiguous";
  }
  return "unknown";
}

Eigen::Vector3d place_on_board(const BoardProblem& problem, const BoardIndex& at) {
  const Eigen::Vector2i units = board_units(problem.kind, at);
  return {problem.pitch_mm * units.x(), problem.pitch_mm * units.y(), 0};
}

BoardResult find_board(const ImageView& image, const BoardProblem& problem) {
  const std::string wrong = wrong_with(problem);
  if (!wrong.empty()) return refusal(BoardStatus::wrong_problem, wrong);
  if (image.data == nullptr || image.width_px < 16 || image.height_px < 16)
    return refusal(BoardStatus::empty_image, "an image of " + number(image.width_px) + " x " +
                                                 number(image.height_px) + " px is too small for a board");
  return problem.kind == BoardKind::chessboard ? find_chessboard(image, problem)
                                               : find_circle_board(image, problem);
}

}  // namespace zeropose
