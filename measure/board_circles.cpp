#include "measure/board_circles.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <string>
#include <tuple>

#include "calib/words.h"
#include "measure/board_grid.h"
#include "measure/board_place.h"
#include "measure/mark_candidates.h"
#include "measure/mark_fit.h"

namespace zeropose {
namespace {

using Eigen::Vector2d;
using Eigen::Vector2i;

constexpr std::size_t most_fits = 4000;  // of things that may be circles, the highest contrast first
constexpr double beside_share = 0.03;    // of the found ones: what may lie beside the board as clutter
constexpr std::size_t most_beside = 2;

std::size_t circles_of(const BoardProblem& problem) {
  return std::size_t(problem.rows) * std::size_t(problem.cols);
}

// Everything round of one polarity.
struct Discs {
  bool dark = true;
  std::vector<MarkFinding> found;
  std::size_t saturated = 0, cut_off = 0;
};

MarkSearch search_of(const ImageView& image, const BoardProblem& problem, bool dark) {
  MarkSearch search;
  search.bright = !dark;
  search.expected_px = search.half_window_px = 0.5 * Vector2d(image.width_px - 1, image.height_px - 1);
  search.min_diameter_px = problem.min_diameter_px;
  const double diagonal = std::hypot(image.width_px, image.height_px);
  // Touching circles of a board that is twice as near on one side.
  search.max_diameter_px =
      std::max(problem.min_diameter_px + 1, 2 * diagonal / std::max(problem.rows, problem.cols));
  search.min_axis_ratio = problem.min_axis_ratio;
  search.min_contrast = problem.min_contrast;
  return search;
}

// The same disc may be taken up twice, from different grey levels.
bool known(const std::vector<MarkFinding>& discs, const Vector2d& u_px) {
  return std::any_of(discs.begin(), discs.end(),
                     [&](const MarkFinding& disc) { return (disc.u_px - u_px).squaredNorm() < 1; });
}

// Adds what is new.
void fit_all(const ImageView& image, const MarkSearch& search, const CandidateSearch& seen,
             EllipseWorkspace& workspace, Discs& discs) {
  discs.saturated = discs.cut_off = 0;
  for (std::size_t k = 0; k < std::min(most_fits, seen.candidates.size()); ++k) {
    const EllipseStart& start = seen.candidates[k].start;
    if (known(discs.found, start.centre_px)) continue;
    const MarkFinding finding = fit_mark(image, search, start, workspace);
    discs.saturated += finding.status == MarkStatus::saturated ? 1 : 0;
    discs.cut_off += finding.status == MarkStatus::cut_off ? 1 : 0;
    if (finding.status == MarkStatus::found && !known(discs.found, finding.u_px))
      discs.found.push_back(finding);
  }
}

struct Sight {
  Discs discs;
  BoardGrid grid;
};

// One polarity at grey levels as fine as wanted.
class Look {
 public:
  Look(const ImageView& image, const BoardProblem& problem, bool dark)
      : image_(image), search_(search_of(image, problem, dark)) {
    sight_.discs.dark = dark;
    take(finder_.first(image_, window(), search_));
  }

  const Sight& sight() const { return sight_; }
  // Half the step between the grey levels; false when that makes no sense.
  bool closer() {
    const auto seen = finder_.finer(image_, search_);
    if (seen) take(*seen);
    return seen.has_value();
  }

 private:
  PixelWindow window() const { return {0, 0, image_.width_px - 1, image_.height_px - 1}; }
  void take(const CandidateSearch& seen) {
    fit_all(image_, search_, seen, workspace_, sight_.discs);
    sight_.grid = find_grid(sight_.discs.found, image_.width_px, image_.height_px);
  }

  ImageView image_;
  MarkSearch search_;
  CandidateFinder finder_;
  EllipseWorkspace workspace_;
  Sight sight_;
};

// Dark circles first; the other polarity and finer levels only when some are missing.
Sight look_for(const ImageView& image, const BoardProblem& problem) {
  const std::size_t wanted = circles_of(problem);
  Look dark(image, problem, true);
  if (dark.sight().grid.points.size() >= wanted) return dark.sight();
  Look bright(image, problem, false);
  const bool is_bright = bright.sight().grid.points.size() > dark.sight().grid.points.size();
  Look& best = is_bright ? bright : dark;
  if (best.sight().grid.points.size() < wanted) best.closer();
  return best.sight();
}

std::string size_text(int a, int b) { return number(a) + " x " + number(b); }

// What was seen, for the sentences.
struct Words {
  const BoardProblem& problem;
  const Sight& sight;

  std::string count(std::size_t found) const {
    return "found " + number(found) + " of " + number(circles_of(problem)) + " circles";
  }
  std::string rejected() const {
    std::string text;
    if (sight.discs.saturated > 0)
      text += "; " + number(sight.discs.saturated) + " more stand out but are saturated: expose less";
    if (sight.discs.cut_off > 0)
      text += "; " + number(sight.discs.cut_off) + " are cut by the image's border";
    return text;
  }
  // Number of lattice lines in both directions.
  std::string extent() const {
    Vector2i low = sight.grid.points.front().at, high = low;
    for (const LatticePoint& point : sight.grid.points)
      low = low.cwiseMin(point.at), high = high.cwiseMax(point.at);
    const Vector2i lines = high - low + Vector2i(1, 1);
    return problem.kind == BoardKind::asymmetric_circles
               ? size_text(lines.x(), lines.y()) + " counted along the diagonals"
               : size_text(lines.x(), lines.y());
  }
};

BoardResult refusal(BoardStatus status, std::string reason, const Sight& sight) {
  BoardResult result;
  result.status = status;
  result.reason = std::move(reason);
  result.dark_on_light = sight.discs.dark;
  return result;
}

// The reading whose first point is nearest to the top left pixel.
double distance_of_first(const BoardProblem& problem, const Sight& sight, const BoardReading& reading) {
  const auto first = sight.grid.plane->pixel(reading.in_lattice(board_units(problem.kind, {0, 0})));
  return first ? first->norm() : std::numeric_limits<double>::max();
}

// Where several do not agree: the smallest row and column found as small as they can be.
int least_index(const BoardProblem& problem, const Sight& sight, const BoardReading& reading) {
  int row = problem.rows, col = problem.cols;
  for (const LatticePoint& point : sight.grid.points) {
    const auto at = board_index(problem, reading.on_board(point.at));
    if (at) row = std::min(row, at->row), col = std::min(col, at->col);
  }
  return row + col;
}

const BoardReading& choose(const BoardProblem& problem, const Sight& sight, const BoardReadings& readings) {
  const auto rank = [&](const BoardReading& reading) {
    return std::pair(readings.equivalent ? 0 : least_index(problem, sight, reading),
                     distance_of_first(problem, sight, reading));
  };
  const BoardReading* best = &readings.best.front();
  auto best_rank = rank(*best);
  for (const BoardReading& reading : readings.best) {
    const auto own = rank(reading);
    if (own < best_rank) best = &reading, best_rank = own;
  }
  return *best;
}

BoardPoint point_of(const BoardProblem& problem, const BoardIndex& at, const MarkFinding& disc) {
  return {at, place_on_board(problem, at), disc.u_px, disc.covariance_px2, disc.diameter_px};
}

bool before(const BoardIndex& a, const BoardIndex& b) {
  return std::tie(a.row, a.col) < std::tie(b.row, b.col);
}

void list_points(const BoardProblem& problem, const Sight& sight, const BoardReading& reading,
                 BoardResult& result) {
  for (const LatticePoint& point : sight.grid.points) {
    const auto at = board_index(problem, reading.on_board(point.at));
    if (at) result.points.push_back(point_of(problem, *at, sight.discs.found[point.disc]));
  }
  std::sort(result.points.begin(), result.points.end(),
            [](const BoardPoint& a, const BoardPoint& b) { return before(a.at, b.at); });
}

// Of the whole board, or where its place is not known of the part between the outermost found ones.
void list_missing(const BoardProblem& problem, BoardResult& result) {
  BoardIndex low, high{problem.rows - 1, problem.cols - 1};
  if (!result.place_known) {
    low = high = result.points.front().at;
    for (const BoardPoint& point : result.points) {
      low = {std::min(low.row, point.at.row), std::min(low.col, point.at.col)};
      high = {std::max(high.row, point.at.row), std::max(high.col, point.at.col)};
    }
  }
  std::size_t next = 0;
  for (int row = low.row; row <= high.row; ++row) {
    for (int col = low.col; col <= high.col; ++col) {
      const BoardIndex at{row, col};
      while (next < result.points.size() && before(result.points[next].at, at)) ++next;
      if (next == result.points.size() || !(result.points[next].at == at)) result.missing.push_back(at);
    }
  }
}

BoardResult accept(const BoardProblem& problem, const Sight& sight, const BoardReadings& readings) {
  BoardResult result;
  result.status = BoardStatus::found;
  result.dark_on_light = sight.discs.dark;
  result.place_known = readings.equivalent;
  result.equivalent_readings = static_cast<int>(readings.best.size());
  list_points(problem, sight, choose(problem, sight, readings), result);
  list_missing(problem, result);
  const Words words{problem, sight};
  if (result.points.size() < circles_of(problem)) {
    result.reason = words.count(result.points.size()) + words.rejected();
    if (!result.place_known)
      result.reason += "; which part of the board they are is not known (" + number(readings.best.size()) +
                       " places fit), rows and columns are counted from the first found";
  }
  return result;
}

}  // namespace

BoardResult find_circle_board(const ImageView& image, const BoardProblem& problem) {
  const Sight sight = look_for(image, problem);
  const Words words{problem, sight};
  if (sight.grid.points.empty())
    return refusal(BoardStatus::no_grid,
                   "found no regular grid among " + number(sight.discs.found.size()) +
                       " round things, expected " + number(circles_of(problem)) + " circles" +
                       words.rejected(),
                   sight);
  std::vector<Vector2i> lattice;
  for (const LatticePoint& point : sight.grid.points) lattice.push_back(point.at);
  const BoardReadings readings = read_board(problem, lattice);
  const std::size_t on_board = lattice.size() - readings.beside;
  if (readings.beside > most_beside || double(readings.beside) > beside_share * double(lattice.size()) ||
      (readings.beside > 0 && !readings.equivalent))
    return refusal(BoardStatus::wrong_size,
                   "found a grid of " + words.extent() + " with " + number(lattice.size()) +
                       " circles, which does not fit the board of " + size_text(problem.rows, problem.cols) +
                       " (rows x columns): at least " + number(readings.beside) + " would lie beside it",
                   sight);
  if (double(on_board) < problem.least_share * double(circles_of(problem)))
    return refusal(BoardStatus::too_few,
                   words.count(on_board) + ", at least " + number(100 * problem.least_share, 0) +
                       " % are needed" + words.rejected(),
                   sight);
  if (!readings.equivalent && !problem.partial)
    return refusal(BoardStatus::ambiguous,
                   words.count(on_board) + " on a grid of " + words.extent() + ", which fits the board of " +
                       size_text(problem.rows, problem.cols) + " in " + number(readings.best.size()) +
                       " places: an outer row or column is hidden or outside the image, or the number of "
                       "rows and columns is wrong" +
                       words.rejected(),
                   sight);
  return accept(problem, sight, readings);
}

}  // namespace zeropose
