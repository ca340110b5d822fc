#include "calib/hand_eye.h"

#include <algorithm>
#include <cmath>

#include "calib/chance.h"
#include "calib/hand_eye_parts.h"
#include "calib/words.h"

namespace zeropose {
namespace {

using namespace hand_eye;

// A robot whose poses are worse has no calibration.
constexpr double plausible_mm = 5, plausible_deg = 1;
constexpr double plausible_px = 1;          // marks and corners are found ten times better
constexpr double max_removed_share = 0.34;  // of the views: more were not mistakes of single ones
// A board's scale that is wrong by more is said, where it is sure.
constexpr double notable_scale = 0.002, sure_sigmas = 3;
// Below, the noise of pixels is none that a camera has.
constexpr double least_sigma_px = 1e-3;
const std::string open_camera = "the camera's place";

HandEyeResult failed(HandEyeStatus status, std::string reason) {
  HandEyeResult result;
  result.status = status;
  result.reason = std::move(reason);
  return result;
}

HandEyeResult fault_of(const HandEyeProblem& problem) {
  const auto wrong = [](double sigma) { return !(sigma >= 0 && std::isfinite(sigma)); };
  if (wrong(problem.sigma_px) || wrong(problem.robot_sigma_mm) || wrong(problem.robot_sigma_deg))
    return failed(HandEyeStatus::wrong_problem, "a sigma is no number from 0 on");
  for (const HandEyeView& view : problem.views)
    if (!view.X_RH.matrix().allFinite())
      return failed(HandEyeStatus::wrong_problem,
                    "the robot's pose of view " + view.name + " has a number that is not finite");
  return {};
}

std::vector<Pose> hand_poses(std::span<const SeenView> views) {
  std::vector<Pose> X_RH;
  for (const SeenView& view : views) X_RH.push_back(view.X_RH);
  return X_RH;
}

std::string names_of(const HandEyeProblem& problem, const std::vector<std::size_t>& views) {
  std::string text;
  for (const std::size_t view : views) text += (text.empty() ? "" : ", ") + problem.views[view].name;
  return text;
}

std::vector<SeenView> look_at_all(const HandEyeProblem& problem, HandEyeResult& result) {
  std::vector<SeenView> seen;
  for (std::size_t v = 0; v < problem.views.size(); ++v)
    if (auto view = look(problem, v, std::nullopt, result.views[v])) seen.push_back(std::move(*view));
  return seen;
}

// Again those whose picture several poses explain: the others say where the board is.
void look_again(const HandEyeProblem& problem, const State& state, std::vector<SeenView>& seen,
                HandEyeResult& result) {
  for (std::size_t v = 0; v < problem.views.size(); ++v) {
    if (result.views[v].points_used > 0) continue;
    HandEyeViewResult again;
    const Pose X_CB = predicted(problem.setup, state, problem.views[v].X_RH);
    auto view = look(problem, v, X_CB, again);
    if (!view) continue;
    result.views[v] = again;
    seen.push_back(std::move(*view));
  }
  std::ranges::sort(seen, {}, &SeenView::index);
}

bool shortage(const HandEyeProblem& problem, const std::vector<SeenView>& seen, HandEyeResult& result) {
  if (seen.size() < 3) {
    result.status = HandEyeStatus::too_few_views;
    result.reason = number(seen.size()) + " views in which the board's pose was found, of " +
                    number(problem.views.size()) + ", needed 3 and more, better 10";
    for (std::size_t v = 0; v < problem.views.size(); ++v)
      if (!result.views[v].reason.empty()) {
        result.reason += "; view " + problem.views[v].name + ": " + result.views[v].reason;
        break;
      }
    return true;
  }
  const std::vector<Pose> X_RH = hand_poses(seen);
  result.turns = turns_of(X_RH);
  if (turns_suffice(result.turns)) return false;
  result.status = HandEyeStatus::rotation_missing;
  result.reason = missing_turn(result.turns, open_camera);
  const std::string other = explanation(problem, seen);
  if (!other.empty()) result.reason += "; " + other;
  for (const std::string& doubt : doubtful_units(X_RH))
    if (other.empty()) result.reason += "; " + doubt;
  return true;
}

Noise noise_of(const HandEyeProblem& problem, std::span<const SeenView> views) {
  Noise noise{problem.sigma_px, problem.robot_sigma_mm, problem.robot_sigma_deg / degrees_per_radian};
  double cost = 0, equations = 0;
  for (const SeenView& view : views) {
    cost += view.cost;
    equations += 2 * static_cast<double>(view.points.size()) - 6;
  }
  if (noise.px == 0) noise.px = equations > 0 ? std::max(least_sigma_px, std::sqrt(cost / equations)) : 0.1;
  return noise;
}

bool robot_known(const HandEyeProblem& problem) {
  return problem.robot_sigma_mm > 0 || problem.robot_sigma_deg > 0;
}

Noise with_usual_robot(Noise noise) {
  noise.mm = usual_robot_mm;
  noise.rad = usual_robot_deg / degrees_per_radian;
  return noise;
}

std::vector<SeenView> only_used(const std::vector<SeenView>& seen, const std::vector<bool>& used) {
  std::vector<SeenView> views;
  for (std::size_t i = 0; i < seen.size(); ++i)
    if (used[i]) views.push_back(seen[i]);
  return views;
}

// Views without which the others leave the camera open: no fit without them can tell whether they are wrong.
std::vector<std::size_t> indispensable(std::span<const SeenView> seen) {
  std::vector<std::size_t> views;
  for (std::size_t i = 0; i < seen.size(); ++i) {
    std::vector<Pose> rest = hand_poses(seen);
    rest.erase(rest.begin() + static_cast<std::ptrdiff_t>(i));
    if (!turns_suffice(turns_of(rest))) views.push_back(seen[i].index);
  }
  return views;
}

// Takes the wrong views out; result.removed and suspects. The fit is of what is left.
WrongPoints judge_views(const HandEyeProblem& problem, const std::vector<SeenView>& seen, PointFit fit,
                        std::vector<bool>& used, HandEyeResult& result) {
  WrongPointOptions options;
  options.sigma_px = robot_known(problem) ? 1 : 0;
  options.least_sigma_px = 1;  // a robot is never taken for better than usual
  WrongPoints wrong;
  wrong.agree = true;
  wrong.fit = std::move(fit);
  if (!problem.reject_wrong_views) return wrong;
  wrong.agree = wrong.fit.status == PointFitStatus::ok;
  if (!wrong.agree) return wrong;
  wrong = remove_wrong_points(std::move(wrong.fit), used, options);
  for (const std::size_t view : wrong.removed) result.removed.push_back(seen[view].index);
  for (const std::size_t view : wrong.suspects) result.suspects.push_back(seen[view].index);
  // As before the last one was taken out.
  std::vector<bool> before = used;
  if (!wrong.removed.empty()) before[wrong.removed.back()] = true;
  if (!result.removed.empty() || !result.suspects.empty())
    for (const std::size_t view : indispensable(only_used(seen, before)))
      if (std::ranges::find(result.suspects, view) == result.suspects.end()) result.suspects.push_back(view);
  // It is open which, so those that were taken out are not wrong for sure either.
  if (!result.suspects.empty())
    for (const std::size_t view : result.removed)
      if (std::ranges::find(result.suspects, view) == result.suspects.end()) result.suspects.push_back(view);
  return wrong;
}

void fill_views(const HandEyeProblem& problem, std::span<const SeenView> seen, const std::vector<bool>& used,
                const State& state, HandEyeResult& result) {
  double squares_px = 0, squares_mm = 0, squares_deg = 0, points = 0, views = 0;
  for (std::size_t i = 0; i < seen.size(); ++i) {
    HandEyeViewResult& view = result.views[seen[i].index];
    const Vector6 error = error_of(state, {X_FG_of(problem.setup, seen[i].X_RH), seen[i].X_CB});
    view.used = used[i];
    if (!used[i]) view.reason = "it contradicts the others";
    view.error_mm = error.head<3>().norm();
    view.error_deg = error.tail<3>().norm() * degrees_per_radian;
    const Pose X_CB = predicted(problem.setup, state, seen[i].X_RH);
    double squares = 0;
    for (const bundle::SeenPoint& point : seen[i].points) {
      const auto u_px = project(problem.model, X_CB * point.p_B_mm);
      squares += u_px ? (*u_px - point.u_px).squaredNorm() : std::numeric_limits<double>::infinity();
    }
    view.rms_px = std::sqrt(squares / static_cast<double>(seen[i].points.size()));
    if (!used[i]) continue;
    squares_px += squares, points += static_cast<double>(seen[i].points.size());
    squares_mm += view.error_mm * view.error_mm, squares_deg += view.error_deg * view.error_deg, ++views;
  }
  result.rms_px = std::sqrt(squares_px / points);
  result.rms_mm = std::sqrt(squares_mm / views);
  result.rms_deg = std::sqrt(squares_deg / views);
}

void fill_estimate(const HandEyeProblem& problem, const Refined& refined, std::size_t used,
                   HandEyeResult& result) {
  result.X_FC = refined.state.X_FC;
  result.X_GB = refined.state.X_GB;
  result.redundancy = static_cast<int>(6 * used) - 12;
  if (!robot_known(problem) && refined.converged)
    result.few_views_factor = few_data_factor(6, static_cast<int>(std::clamp(refined.degrees, 1.0, 1e5)));
  result.covariance_FC = result.few_views_factor * refined.covariance.topLeftCorner<6, 6>();
  result.covariance_GB = result.few_views_factor * refined.covariance.bottomRightCorner<6, 6>();
  result.sigma_px = refined.noise.px;
  result.robot_sigma_mm = refined.noise.mm;
  result.robot_sigma_deg = refined.noise.rad * degrees_per_radian;
  result.scale = refined.scale;
  result.scale_sigma = refined.scale_sigma * std::sqrt(result.few_views_factor);
}

void warn_of_scale(HandEyeResult& result) {
  const double share = result.scale - 1;
  if (std::abs(share) <= notable_scale || std::abs(share) <= sure_sigmas * result.scale_sigma) return;
  result.warnings.push_back("the board's pitch looks " + number(100 * std::abs(share)) + " % too " +
                            (share > 0 ? "small" : "large") + " (sigma " + number(100 * result.scale_sigma) +
                            " %), or the camera's focal lengths or the robot's positions are wrong");
}

void warn(const HandEyeProblem& problem, const std::vector<SeenView>& seen, HandEyeResult& result) {
  const std::vector<Pose> X_RH = hand_poses(seen);
  result.warnings = doubtful_units(X_RH);
  if (std::string small = small_turns(result.turns); !small.empty())
    result.warnings.push_back(std::move(small));
  warn_of_scale(result);
  for (const std::string& swap : swapped_views(problem, seen, {result.X_FC, result.X_GB}, result.removed))
    result.warnings.push_back(swap);
}

// Of one coordinate, from the views' own poses; what their covariances say does not count here.
double missed_px(std::span<const SeenView> views) {
  double squares = 0, equations = 0;
  for (const SeenView& view : views) {
    squares += view.squares_px2;
    equations += 2 * static_cast<double>(view.points.size()) - 6;
  }
  return equations > 0 ? std::sqrt(squares / equations) : 0;
}

void judge(const HandEyeProblem& problem, const WrongPoints& wrong, const std::vector<SeenView>& seen,
           HandEyeResult& result) {
  const bool plausible =
      robot_known(problem) ? std::isfinite(result.rms_mm)
                           : result.robot_sigma_mm <= plausible_mm && result.robot_sigma_deg <= plausible_deg;
  const bool most_agree = max_removed_share * static_cast<double>(problem.views.size()) >=
                          static_cast<double>(result.removed.size());
  const bool points_fit = problem.sigma_px > 0 || missed_px(seen) <= plausible_px;
  if (wrong.agree && plausible && most_agree && points_fit && result.suspects.empty()) return;
  result.status = HandEyeStatus::contradiction;
  if (!points_fit) {
    result.reason = "in the views the points miss their pixels by " + number(missed_px(seen)) +
                    " px: are these this camera's internals and this board's points?";
    return;
  }
  result.reason = "robot and pictures contradict each other by " + number(result.rms_mm) + " mm and " +
                  number(result.rms_deg, 3) + " degrees (root mean square)";
  const std::string known = explanation(problem, seen);
  if (!known.empty())
    result.reason += ": " + known;
  else if (plausible && !result.suspects.empty())
    result.reason += ", wrong is one of views " + names_of(problem, result.suspects) +
                     ": the robot was moving, or its pose is another view's; repeat them, or add views";
  else if (!most_agree)
    result.reason += ", and agree only without " + number(result.removed.size()) + " of " +
                     number(problem.views.size()) + " views: repeat them";
  else if (plausible)
    result.reason += ", more than the stated noise allows, and no single view explains it";
  else
    result.reason +=
        ", and no single view explains it: look at the angles' convention, the tool frame of the robot's "
        "poses and the order of the views";
}

}  // namespace

std::string_view name_of(HandEyeStatus status) {
  switch (status) {
    case HandEyeStatus::ok:
      return "ok";
    case HandEyeStatus::wrong_problem:
      return "wrong_problem";
    case HandEyeStatus::too_few_views:
      return "too_few_views";
    case HandEyeStatus::rotation_missing:
      return "rotation_missing";
    case HandEyeStatus::contradiction:
      return "contradiction";
    case HandEyeStatus::not_converged:
      return "not_converged";
    default:
      return "failed";
  }
}

HandEyeResult calibrate_hand_eye(const HandEyeProblem& problem) {
  HandEyeResult result = fault_of(problem);
  if (result.status != HandEyeStatus::failed) return result;
  result.views.resize(problem.views.size());
  std::vector<SeenView> seen = look_at_all(problem, result);
  if (shortage(problem, seen, result)) return result;

  State start = robust_start(loops_of(problem.setup, seen));
  if (seen.size() < problem.views.size()) look_again(problem, start, seen, result);
  std::vector<bool> used(seen.size(), true);
  const Noise noise = noise_of(problem, seen);
  const Noise expected = robot_known(problem) ? noise : with_usual_robot(noise);
  PointFit fit = fit_points(*equations_at(problem.setup, seen, start, expected), used);
  if (fit.status == PointFitStatus::ok) start = state_of(fit);
  WrongPoints wrong = judge_views(problem, seen, std::move(fit), used, result);
  if (wrong.fit.status == PointFitStatus::ok) start = state_of(wrong.fit);
  const std::vector<SeenView> good = only_used(seen, used);
  result.turns = turns_of(hand_poses(good));
  const Refined refined = refine(problem.model, problem.setup, good, start, expected, !robot_known(problem));
  fill_estimate(problem, refined, good.size(), result);
  fill_views(problem, seen, used, refined.state, result);
  result.status = refined.converged ? HandEyeStatus::ok : HandEyeStatus::not_converged;
  if (!refined.converged) result.reason = "the joint estimate did not converge";
  warn(problem, seen, result);
  judge(problem, wrong, seen, result);
  return result;
}

}  // namespace zeropose
