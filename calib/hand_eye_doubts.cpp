#include <algorithm>
#include <cmath>

#include "calib/hand_eye_parts.h"
#include "calib/words.h"

namespace zeropose::hand_eye {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

// Loops that do not close by more, in the closed form, are not explained.
constexpr double plausible_mm = 20;
constexpr double clearly_better = 0.1;
// Mm per rad where both are put into one figure.
constexpr double lever_mm = 300;

double size_of(const Vector6& error) { return error.head<3>().norm() + lever_mm * error.tail<3>().norm(); }

double median_of(std::vector<double> values) {
  std::ranges::sort(values);
  return values[values.size() / 2];
}

std::vector<double> sizes_of(std::span<const Loop> loops) {
  const State state = closed_form(loops);
  std::vector<double> sizes;
  for (const Loop& loop : loops) sizes.push_back(size_of(error_of(state, loop)));
  return sizes;
}

std::vector<Loop> with_hand_poses(HandEyeSetup setup, std::span<const SeenView> views,
                                  std::span<const Pose> X_RH) {
  std::vector<Loop> loops = loops_of(setup, views);
  for (std::size_t i = 0; i < loops.size(); ++i) loops[i].X_FG = X_FG_of(setup, X_RH[i]);
  return loops;
}

std::string reading_explains(const HandEyeProblem& problem, std::span<const SeenView> views,
                             std::span<const Pose> X_RH) {
  const Misfit misfit = [&](std::span<const Pose> poses) -> std::optional<double> {
    if (!turns_suffice(turns_of(poses))) return std::nullopt;
    return median_of(sizes_of(with_hand_poses(problem.setup, views, poses)));
  };
  const Reading reading = better_reading(X_RH, misfit, plausible_mm);
  if (reading == Reading::as_expected) return {};
  std::string text = "the robot's poses look like " + words_of(reading);
  if (reading == Reading::inverse)
    text += problem.setup == HandEyeSetup::eye_to_hand
                ? ", or the camera is on the hand (eye in hand)"
                : ", or the camera stands beside the robot (eye to hand)";
  return text;
}

// The scale of the board with which the loops close best: R_FG t_GB + t_FG = scale R_FC t_CB + t_FC.
double free_scale(std::span<const Loop> loops, const State& state, std::vector<double>& errors) {
  const auto n = static_cast<Eigen::Index>(loops.size());
  std::vector<Pose> given, seen;
  for (const Loop& loop : loops) {
    given.push_back(loop.X_FG);
    seen.push_back(loop.X_FG);
    seen.back().translation() = state.X_FC.linear() * loop.X_CB.translation();
  }
  // Both sides less what the free places explain of them; the scale carries one onto the other.
  const FixedPoint fixed_given = fixed_point(given), fixed_seen = fixed_point(seen);
  Eigen::VectorXd a(3 * n), b(3 * n);
  for (Eigen::Index i = 0; i < n; ++i) {
    const auto k = static_cast<std::size_t>(i);
    a.segment<3>(3 * i) = seen[k] * fixed_seen.p_mm - fixed_seen.c_mm;
    b.segment<3>(3 * i) = given[k] * fixed_given.p_mm - fixed_given.c_mm;
  }
  const double scale = a.dot(b) / a.squaredNorm();
  errors.clear();
  for (Eigen::Index i = 0; i < n; ++i)
    errors.push_back((b - scale * a).segment<3>(3 * i).norm() +
                     lever_mm * error_of(state, loops[static_cast<std::size_t>(i)]).tail<3>().norm());
  return scale;
}

std::string scale_explains(std::span<const Loop> loops) {
  std::vector<double> errors;
  const double scale = free_scale(loops, closed_form(loops), errors);
  const double limit = std::min(plausible_mm, clearly_better * median_of(sizes_of(loops)));
  if (!(scale > 0) || !(median_of(errors) < limit)) return {};
  return scale > 1 ? "the board's coordinates (its pitch) look " + number(scale, 3) + " times too small"
                   : "the board's coordinates (its pitch) look " + number(1 / scale, 3) + " times too large";
}

double rms_of(const std::vector<double>& sizes) {
  double sum = 0;
  for (const double size : sizes) sum += size * size;
  return std::sqrt(sum / static_cast<double>(sizes.size()));
}

// Two views, or all of them, beside the wrong pose of the hand.
std::string order_explains(const HandEyeProblem& problem, std::span<const SeenView> views,
                           const std::vector<Pose>& X_RH) {
  std::string text;
  double limit = rms_of(sizes_of(with_hand_poses(problem.setup, views, X_RH))) * clearly_better;
  const auto consider = [&](const std::vector<Pose>& poses, const std::string& words) {
    const double rms = rms_of(sizes_of(with_hand_poses(problem.setup, views, poses)));
    if (rms < std::min(limit, plausible_mm)) limit = rms, text = words;
  };
  for (const int shift : {1, -1}) {
    std::vector<Pose> poses = X_RH;
    std::rotate(poses.begin(), shift > 0 ? poses.begin() + 1 : poses.end() - 1, poses.end());
    consider(poses, "the robot's poses look shifted by one view against the pictures");
  }
  constexpr std::size_t most_views = 40;  // of whose pairs all are tried
  for (std::size_t i = 0; i < views.size() && views.size() <= most_views; ++i)
    for (std::size_t j = i + 1; j < views.size(); ++j) {
      std::vector<Pose> poses = X_RH;
      std::swap(poses[i], poses[j]);
      consider(poses, "the robot's poses of views " + problem.views[views[i].index].name + " and " +
                          problem.views[views[j].index].name + " look swapped");
    }
  return text;
}

}  // namespace

std::string explanation(const HandEyeProblem& problem, std::span<const SeenView> views) {
  std::vector<Pose> X_RH;
  for (const SeenView& view : views) X_RH.push_back(view.X_RH);
  if (std::string text = reading_explains(problem, views, X_RH); !text.empty()) return text;
  if (!turns_suffice(turns_of(X_RH))) return {};
  if (std::string text = scale_explains(loops_of(problem.setup, views)); !text.empty()) return text;
  return order_explains(problem, views, X_RH);
}

std::vector<std::string> swapped_views(const HandEyeProblem& problem, std::span<const SeenView> views,
                                       const State& state, std::vector<std::size_t> removed) {
  const auto error = [&](const SeenView& view, const SeenView& hand) {
    return size_of(error_of(state, {X_FG_of(problem.setup, hand.X_RH), view.X_CB}));
  };
  const auto view_of = [&](std::size_t index) -> const SeenView& {
    return *std::ranges::find(views, index, &SeenView::index);
  };
  std::ranges::sort(removed);
  std::vector<std::string> found;
  for (std::size_t i = 0; i < removed.size(); ++i)
    for (std::size_t j = i + 1; j < removed.size(); ++j) {
      const SeenView &a = view_of(removed[i]), &b = view_of(removed[j]);
      const double given = std::min(error(a, a), error(b, b)), swapped = std::max(error(a, b), error(b, a));
      if (swapped < std::min(plausible_mm, clearly_better * given))
        found.push_back("the robot's poses of views " + problem.views[a.index].name + " and " +
                        problem.views[b.index].name + " look swapped");
    }
  return found;
}

}  // namespace zeropose::hand_eye
