// The projector's lines in one image, put in order by their crossings (spec 70, wheel-alignment).
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "measure/light_lines.h"

namespace zeropose {

// Three radial lines (left, middle, right) and so many across them, counted from the outer one to the inner
// one. One of those, the control line, crosses all three radial lines; the others stop between the middle and
// the right one. So only one order of the lines fits the crossings.
struct LineLayout {
  std::size_t across = 3;
  std::size_t control = 1;  // index among them
};

inline constexpr std::size_t radial_lines = 3;
std::string_view radial_name(std::size_t line);  // left, middle, right

struct LineArrayProblem {
  ImageView image;
  LineLayout layout;
  LightLineSearch search;
  // Directions in the image: from the left radial line to the right one, and outwards on the wheel. The
  // former lies within 30 degrees of a row, the latter of a column.
  Eigen::Vector2d right_px = Eigen::Vector2d::UnitX(), outwards_px = -Eigen::Vector2d::UnitY();
  double min_share_seen = 0.7;  // of each radial line between its ends
  double crossing_gap_px = 14;  // a crossing is seen when both lines are, so near to it
};

enum class LineArrayStatus {
  failed = 0,
  ok,
  wrong_problem,     // no image, directions or a layout that make no sense
  radial_missing,    // fewer than three radial lines
  across_missing,    // fewer lines across than the layout has
  crossing_missing,  // lines that should cross do not, or the place is covered
  order_ambiguous,   // more lines than the layout has, or more than one control line
  wrong_order,       // the crossings fit the layout's mirror image, or another control line
  too_dirty          // too little of a radial line is seen
};
std::string_view name_of(LineArrayStatus status);

struct LineArrayResult {
  LineArrayStatus status = LineArrayStatus::failed;
  std::string reason;                          // one sentence, empty when ok
  std::array<LightLine, radial_lines> radial;  // left, middle, right
  std::vector<LightLine> across;               // from outside to inside
  // By line across and radial line: where they cross, px; none where the layout has no crossing.
  std::vector<std::array<std::optional<Eigen::Vector2d>, radial_lines>> crossings;
  // What was found, whatever the status: for pictures and messages.
  std::vector<LightLine> found;
};

// Lines that cross no other one (edges, letters, dirt) are left out of the count.
LineArrayResult order_lines(const LineArrayProblem& problem);

}  // namespace zeropose
