#include "measure/line_array.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "calib/words.h"

namespace zeropose {
namespace {

using Eigen::Vector2d;

constexpr int crossing_halvings = 30;
constexpr double end_sigmas = 4;   // of a line: so near to its end another one does not cross it
constexpr double most_turn = 0.5;  // sine of 30 degrees

// Pixel by pixel along the upright line until it has passed the level one, then between by halves: where they
// meet their centres pull each other, so that steps from one line to the other need not settle. Nothing where
// they do not meet clear of their ends: the round end of a line may look like a short piece of another one.
std::optional<Vector2d> crossing_of(const LightLine& upright, const LightLine& level, double end_px) {
  const auto above = [&](double v) {  // px; below 0: past the level line
    const auto u = upright.place_at(v);
    const auto there = u ? level.place_at(*u) : std::nullopt;
    return there ? std::optional(*there - v) : std::nullopt;
  };
  const auto [highest, lowest] = std::ranges::minmax(level.centres, {}, &LineCentre::place);
  const double end = std::min(upright.to(), lowest.place + 1);
  for (double v = std::max(upright.from(), highest.place - 1); v < end; v += 1) {
    double from = v, to = std::min(v + 1, end);
    const auto before = above(from), after = above(to);
    if (!before || !after || *before < 0 || *after > 0) continue;
    for (int step = 0; step < crossing_halvings; ++step) {
      const double middle = (from + to) / 2;
      const auto there = above(middle);
      if (!there) return std::nullopt;
      (*there >= 0 ? from : to) = middle;
    }
    const double u = *upright.place_at(from);
    const bool clear =
        std::min({from - upright.from(), upright.to() - from, u - level.from(), level.to() - u}) > end_px;
    return clear ? std::optional<Vector2d>({u, from}) : std::nullopt;
  }
  return std::nullopt;
}

struct Found {
  double end_px = 0;                      // crossings count so far from the ends of both lines
  std::vector<LightLine> radial, across;  // left to right, outside to inside
  // [across][radial]
  std::vector<std::vector<std::optional<Vector2d>>> crossings;

  std::size_t of_radial(std::size_t line) const {
    return static_cast<std::size_t>(
        std::ranges::count_if(crossings, [&](const auto& row) { return row[line].has_value(); }));
  }
  std::size_t of_across(std::size_t line) const {
    return static_cast<std::size_t>(
        std::ranges::count_if(crossings[line], [](const auto& crossing) { return crossing.has_value(); }));
  }
  void cross() {
    crossings.clear();
    for (const LightLine& level : across) {
      auto& row = crossings.emplace_back();
      for (const LightLine& upright : radial) row.push_back(crossing_of(upright, level, end_px));
    }
  }
};

// Lines that hang together by crossings are a group; of each line (the radial ones first) how many crossings
// its group has.
std::vector<std::size_t> crossings_of_groups(const Found& found) {
  const std::size_t radial = found.radial.size();
  std::vector<std::size_t> group(radial + found.across.size());
  std::iota(group.begin(), group.end(), std::size_t{0});
  std::vector<std::size_t> crossings(group.size());
  for (std::size_t a = 0; a < found.across.size(); ++a)
    for (std::size_t r = 0; r < radial; ++r)
      if (found.crossings[a][r]) {
        const std::size_t one = group[r], other = group[radial + a];
        std::ranges::replace(group, one, other);
      }
  for (std::size_t a = 0; a < found.across.size(); ++a) crossings[group[radial + a]] += found.of_across(a);
  for (std::size_t& of_line : group) of_line = crossings[of_line];
  return group;
}

// The group with the most crossings stays, of equals all; what crosses nothing goes. The lines stand in the
// order in which they cross the image's middle of the other kind.
Found sorted(std::vector<LightLine> radial, std::vector<LightLine> across, const LineArrayProblem& problem) {
  Found found{end_sigmas * problem.search.sigma_px, std::move(radial), std::move(across), {}};
  found.cross();
  const std::vector<std::size_t> crossings = crossings_of_groups(found);
  const std::size_t most = crossings.empty() ? 0 : std::max(std::size_t{1}, std::ranges::max(crossings));
  Found kept{found.end_px, {}, {}, {}};
  for (std::size_t i = 0; i < found.radial.size(); ++i)
    if (crossings[i] == most) kept.radial.push_back(found.radial[i]);
  for (std::size_t i = 0; i < found.across.size(); ++i)
    if (crossings[found.radial.size() + i] == most) kept.across.push_back(found.across[i]);
  const auto middle = [](const LightLine& line) { return line.centres[line.centres.size() / 2].place; };
  const double right = problem.right_px.x(), outwards = problem.outwards_px.y();
  std::ranges::sort(kept.radial, {}, [&](const LightLine& line) { return right * middle(line); });
  std::ranges::sort(kept.across, {}, [&](const LightLine& line) { return -outwards * middle(line); });
  kept.cross();
  return kept;
}

struct Verdict {
  LineArrayStatus status = LineArrayStatus::ok;
  std::string reason;
};

Verdict missing_radial(const Found& found, const LineLayout& layout) {
  const std::size_t count = found.radial.size();
  std::string which = number(count) + " of 3 radial lines are found";
  // Without the control line nothing crosses the right radial line.
  if (count == 2 && found.across.size() < layout.across && found.of_radial(1) == found.across.size())
    return {
        LineArrayStatus::across_missing,
        number(found.across.size()) + " of " + number(layout.across) +
            " lines across are found, none of which crosses three radial lines: the control line is missing, "
            "or the right radial line and another one"};
  if (count == 2) {
    const bool has_right = found.of_radial(1) < found.across.size();
    which += has_right ? ": the left or the middle one is missing" : ": the right one is missing";
  }
  return {LineArrayStatus::radial_missing, which};
}

Verdict missing_across(const Found& found, const LineLayout& layout, std::size_t controls) {
  std::string which =
      number(found.across.size()) + " of " + number(layout.across) + " lines across are found";
  if (controls == 0) which += ": the control line is missing";
  return {LineArrayStatus::across_missing, which};
}

Verdict verdict_on_count(const Found& found, const LineLayout& layout, std::size_t controls) {
  if (found.radial.size() > radial_lines)
    return {LineArrayStatus::order_ambiguous,
            number(found.radial.size()) +
                " radial lines cross others, the layout has 3: one is too many, or broken"};
  if (found.across.size() > layout.across)
    return {LineArrayStatus::order_ambiguous, number(found.across.size()) +
                                                  " lines across cross others, the layout has " +
                                                  number(layout.across) + ": one is too many, or broken"};
  if (found.radial.size() < radial_lines) return missing_radial(found, layout);
  if (found.across.size() < layout.across) return missing_across(found, layout, controls);
  if (controls > 1)
    return {LineArrayStatus::order_ambiguous,
            number(controls) + " lines cross all three radial lines, the control line alone may"};
  if (controls == 0) return {LineArrayStatus::crossing_missing, "no line crosses all three radial lines"};
  return {};
}

// With three radial lines, as many across as there should be, and one control line.
Verdict verdict_on_order(const Found& found, const LineLayout& layout) {
  const bool mirrored =
      found.of_radial(0) == 1 && found.of_radial(1) == layout.across && found.of_radial(2) == layout.across;
  if (mirrored && layout.across > 1)
    return {LineArrayStatus::wrong_order, "the line with one crossing is the left one, not the right one"};
  if (found.of_across(layout.control) != radial_lines)
    return {LineArrayStatus::wrong_order, "the line that crosses all radial lines is not line " +
                                              number(layout.control + 1) + " from outside"};
  for (std::size_t a = 0; a < layout.across; ++a) {
    for (std::size_t r = 0; r < radial_lines; ++r) {
      const bool due = a == layout.control || r + 1 < radial_lines;
      if (found.crossings[a][r].has_value() == due) continue;
      if (due)
        return {LineArrayStatus::crossing_missing, "line " + number(a + 1) + " across does not reach the " +
                                                       std::string(radial_name(r)) + " radial line"};
      return {
          LineArrayStatus::wrong_order,
          "line " + number(a + 1) + " across crosses the right radial line, which only the control line may"};
    }
  }
  return {};
}

Verdict verdict_on_sight(const Found& found, const LineArrayProblem& problem) {
  for (std::size_t r = 0; r < radial_lines; ++r) {
    const LightLine& line = found.radial[r];
    if (line.share_seen() < problem.min_share_seen)
      return {LineArrayStatus::too_dirty, number(100 * line.share_seen(), 0) + " % of the " +
                                              std::string(radial_name(r)) + " radial line is seen"};
    for (std::size_t a = 0; a < found.across.size(); ++a) {
      const auto& crossing = found.crossings[a][r];
      if (!crossing) continue;
      if (line.unseen_px(crossing->y()) > problem.crossing_gap_px ||
          found.across[a].unseen_px(crossing->x()) > problem.crossing_gap_px)
        return {LineArrayStatus::crossing_missing, "the crossing of line " + number(a + 1) +
                                                       " across with the " + std::string(radial_name(r)) +
                                                       " radial line is covered"};
    }
  }
  return {};
}

bool makes_sense(const LineArrayProblem& problem) {
  const Vector2d right = problem.right_px.normalized(), outwards = problem.outwards_px.normalized();
  const LightLineSearch& search = problem.search;
  return problem.image.data && problem.image.width_px > 64 && problem.image.height_px > 64 &&
         std::abs(right.y()) <= most_turn && std::abs(outwards.x()) <= most_turn &&
         problem.layout.across >= 3 && problem.layout.control < problem.layout.across &&
         search.sigma_px >= 0.7 && search.sigma_px <= 8 && search.min_contrast > 0 &&
         search.min_length_px > 0 && search.max_join_px >= 0;
}

Verdict verdict_on(const Found& found, const LineArrayProblem& problem) {
  std::size_t controls = 0;
  for (std::size_t a = 0; a < found.across.size(); ++a) controls += found.of_across(a) >= radial_lines;
  Verdict verdict = verdict_on_count(found, problem.layout, controls);
  if (verdict.status == LineArrayStatus::ok) verdict = verdict_on_order(found, problem.layout);
  if (verdict.status == LineArrayStatus::ok) verdict = verdict_on_sight(found, problem);
  return verdict;
}

}  // namespace

std::string_view radial_name(std::size_t line) {
  constexpr std::string_view names[] = {"left", "middle", "right"};
  return line < radial_lines ? names[line] : "?";
}

std::string_view name_of(LineArrayStatus status) {
  switch (status) {
    case LineArrayStatus::failed:
      return "failed";
    case LineArrayStatus::ok:
      return "ok";
    case LineArrayStatus::wrong_problem:
      return "wrong_problem";
    case LineArrayStatus::radial_missing:
      return "radial_missing";
    case LineArrayStatus::across_missing:
      return "across_missing";
    case LineArrayStatus::crossing_missing:
      return "crossing_missing";
    case LineArrayStatus::order_ambiguous:
      return "order_ambiguous";
    case LineArrayStatus::wrong_order:
      return "wrong_order";
    case LineArrayStatus::too_dirty:
      return "too_dirty";
  }
  return "?";
}

LineArrayResult order_lines(const LineArrayProblem& problem) {
  LineArrayResult result;
  if (!makes_sense(problem)) {
    result.status = LineArrayStatus::wrong_problem;
    result.reason =
        "the image is missing or small, the search's numbers or the layout (three lines across and more, the "
        "control line among them) make no sense, or the camera is turned by more than 30 degrees";
    return result;
  }
  LightLines lines = find_light_lines(problem.image, problem.search);
  result.found = lines.upright;
  result.found.insert(result.found.end(), lines.level.begin(), lines.level.end());
  const Found found = sorted(std::move(lines.upright), std::move(lines.level), problem);
  const Verdict verdict = verdict_on(found, problem);
  result.status = verdict.status;
  result.reason = verdict.reason;
  if (result.status != LineArrayStatus::ok) return result;
  std::ranges::copy(found.radial, result.radial.begin());
  result.across = found.across;
  for (const auto& row : found.crossings) std::ranges::copy(row, result.crossings.emplace_back().begin());
  return result;
}

}  // namespace zeropose
