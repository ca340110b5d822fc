#include "calib/tool.h"

#include <algorithm>
#include <cmath>

#include "calib/chance.h"
#include "calib/point_fit.h"
#include "calib/words.h"

namespace zeropose {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

// Touches that miss the point by more are not touches of one point.
constexpr double plausible_mm = 5;
// No robot touches a point better.
constexpr double least_sigma_mm = 0.01;
const std::string open_end = "the tool's end";

class TouchEquations : public PointEquations {
 public:
  TouchEquations(std::span<const Pose> X_RH, const FixedPoint& at) : X_RH_(X_RH) { at_ << at.p_mm, at.c_mm; }

  std::unique_ptr<PointEquations> copy() const override { return std::make_unique<TouchEquations>(*this); }
  Eigen::Index unknowns() const override { return 6; }
  std::size_t points() const override { return X_RH_.size(); }
  Eigen::Index rows_per_point() const override { return 3; }
  const Vector6& at() const { return at_; }
  void move(const Eigen::VectorXd& delta) override { at_ += delta; }

  bool linearise(std::size_t touch, PointRows& rows) const override {
    rows.r = -(X_RH_[touch] * at_.head<3>() - at_.tail<3>());
    rows.J.resize(3, 6);
    rows.J << X_RH_[touch].linear(), -Matrix3d::Identity();
    return true;
  }

 private:
  std::span<const Pose> X_RH_;
  Vector6 at_;
};

ToolResult failed(ToolStatus status, std::string reason) {
  ToolResult result;
  result.status = status;
  result.reason = std::move(reason);
  return result;
}

ToolResult fault_of(const ToolProblem& problem) {
  if (!(problem.sigma_mm >= 0 && std::isfinite(problem.sigma_mm)))
    return failed(ToolStatus::wrong_problem, "sigma_mm is " + number(problem.sigma_mm) + ", expected >= 0");
  for (std::size_t i = 0; i < problem.X_RH.size(); ++i)
    if (!problem.X_RH[i].matrix().allFinite())
      return failed(ToolStatus::wrong_problem,
                    "touch " + number(i + 1) + " (from 1) has a number that is not finite");
  return {};
}

std::string list_of(const std::vector<std::size_t>& touches) {
  std::string text;
  for (const std::size_t touch : touches) text += (text.empty() ? "" : ", ") + number(touch + 1);
  return text;
}

std::optional<double> misfit_mm(std::span<const Pose> X_RH) {
  if (X_RH.size() < 3 || !turns_suffice(turns_of(X_RH))) return std::nullopt;
  const FixedPoint fixed = fixed_point(X_RH);
  double sum = 0;
  for (const Pose& pose : X_RH) sum += (pose * fixed.p_mm - fixed.c_mm).squaredNorm();
  return std::sqrt(sum / static_cast<double>(X_RH.size()));
}

// The end of a reason: as what else the poses would fit.
std::string other_reading(std::span<const Pose> X_RH) {
  const Reading reading = better_reading(X_RH, misfit_mm, plausible_mm);
  return reading == Reading::as_expected ? "" : "; the poses look like " + words_of(reading);
}

void add_once(std::vector<std::size_t>& touches, std::size_t touch) {
  if (std::ranges::find(touches, touch) == touches.end()) touches.push_back(touch);
}

// Touches of those used without which the others leave the tool open: no fit without them can tell whether
// they are wrong.
std::vector<std::size_t> indispensable(std::span<const Pose> X_RH, std::vector<bool> used) {
  std::vector<std::size_t> touches;
  for (std::size_t i = 0; i < X_RH.size(); ++i) {
    if (!used[i]) continue;
    std::vector<Pose> others;
    for (std::size_t k = 0; k < X_RH.size(); ++k)
      if (used[k] && k != i) others.push_back(X_RH[k]);
    if (!turns_suffice(turns_of(others))) touches.push_back(i);
  }
  return touches;
}

std::vector<std::size_t> suspects_of(const ToolProblem& problem, const WrongPoints& wrong,
                                     std::vector<bool> used) {
  std::vector<std::size_t> suspects = wrong.suspects;
  if (wrong.removed.empty() && suspects.empty()) return suspects;
  if (!wrong.removed.empty()) used[wrong.removed.back()] = true;  // as before the last one was taken out
  for (const std::size_t touch : indispensable(problem.X_RH, std::move(used))) add_once(suspects, touch);
  // It is open which, so those that were taken out are not wrong for sure either.
  if (!suspects.empty())
    for (const std::size_t touch : wrong.removed) add_once(suspects, touch);
  return suspects;
}

void judge_agreement(const ToolProblem& problem, const WrongPoints& wrong, const std::vector<bool>& used,
                     ToolResult& result) {
  result.suspects = suspects_of(problem, wrong, used);
  const bool plausible = result.rms_mm <= plausible_mm;
  if (wrong.agree && result.suspects.empty() && plausible) return;
  result.status = ToolStatus::contradiction;
  result.reason =
      "the touches contradict each other by " + number(result.rms_mm, 3) + " mm (root mean square)";
  if (plausible && !result.suspects.empty())
    result.reason +=
        ", wrong is one of touches " + list_of(result.suspects) + " (from 1): repeat them, or add touches";
  else
    result.reason += ", and no single one explains it";
  result.reason += other_reading(problem.X_RH);
}

void fill(const ToolProblem& problem, const WrongPoints& wrong, const std::vector<bool>& used,
          ToolResult& result) {
  const Vector6& at = static_cast<const TouchEquations&>(*wrong.fit.at).at();
  result.p_HT_mm = at.head<3>();
  result.p_RT_mm = at.tail<3>();
  result.redundancy = wrong.fit.redundancy;
  result.sigma_mm =
      problem.sigma_mm > 0 ? problem.sigma_mm : std::sqrt(wrong.fit.cost / wrong.fit.redundancy);
  const double few = problem.sigma_mm > 0 ? 1 : few_data_factor(3, result.redundancy);
  const Matrix6 covariance = few * result.sigma_mm * result.sigma_mm * wrong.fit.inverse_N;
  result.covariance = covariance.topLeftCorner<3, 3>();
  result.covariance_RT = covariance.bottomRightCorner<3, 3>();
  double sum = 0;
  for (std::size_t i = 0; i < problem.X_RH.size(); ++i) {
    result.residuals_mm.push_back(problem.X_RH[i] * result.p_HT_mm - result.p_RT_mm);
    if (used[i]) sum += result.residuals_mm.back().squaredNorm();
  }
  result.rms_mm = std::sqrt(sum / static_cast<double>(std::ranges::count(used, true)));
  result.removed = wrong.removed;
}

// Inverted poses fit as well, with tool and fixed point exchanged.
void warn_of_inverse(ToolResult& result) {
  const double tool = result.p_HT_mm.norm(), point = result.p_RT_mm.norm();
  if (tool <= point) return;
  result.warnings.push_back("the tool's end is " + number(tool, 1) + " mm from the hand, the fixed point " +
                            number(point, 1) + " mm from the robot's base: the poses look like " +
                            words_of(Reading::inverse));
}

ToolResult shortage_of(const ToolProblem& problem, const HandTurns& turns) {
  const std::size_t count = problem.X_RH.size();
  const std::string needs = number(count) + " touches, a tool needs 3 and more, better 5";
  if (count < 2) return failed(ToolStatus::too_few_touches, needs);
  if (count == 2) return failed(ToolStatus::too_few_touches, needs + ": " + missing_turn(turns, open_end));
  if (turns_suffice(turns)) return {};
  std::string reason = missing_turn(turns, open_end);
  for (const std::string& doubt : doubtful_units(problem.X_RH)) reason += "; " + doubt;
  return failed(ToolStatus::rotation_missing, reason);
}

}  // namespace

std::string_view name_of(ToolStatus status) {
  switch (status) {
    case ToolStatus::ok:
      return "ok";
    case ToolStatus::wrong_problem:
      return "wrong_problem";
    case ToolStatus::too_few_touches:
      return "too_few_touches";
    case ToolStatus::rotation_missing:
      return "rotation_missing";
    case ToolStatus::contradiction:
      return "contradiction";
    default:
      return "failed";
  }
}

ToolResult calibrate_tool(const ToolProblem& problem) {
  if (ToolResult fault = fault_of(problem); fault.status != ToolStatus::failed) return fault;
  const HandTurns turns = turns_of(problem.X_RH);
  ToolResult result = shortage_of(problem, turns);
  result.turns = turns;
  if (result.status != ToolStatus::failed) return result;

  WrongPointOptions options;
  options.sigma_px = problem.sigma_mm;
  options.least_sigma_px = least_sigma_mm;
  std::vector<bool> used(problem.X_RH.size(), true);
  WrongPoints wrong;
  wrong.agree = true;
  wrong.fit = fit_points(TouchEquations(problem.X_RH, fixed_point(problem.X_RH)), used);
  if (wrong.fit.status != PointFitStatus::ok)
    return failed(ToolStatus::failed, "no place of the tool's end was found");
  if (problem.reject_wrong_touches) wrong = remove_wrong_points(std::move(wrong.fit), used, options);
  result.status = ToolStatus::ok;
  fill(problem, wrong, used, result);
  result.warnings = doubtful_units(problem.X_RH);
  if (std::string small = small_turns(turns); !small.empty()) result.warnings.push_back(std::move(small));
  warn_of_inverse(result);
  judge_agreement(problem, wrong, used, result);
  return result;
}

}  // namespace zeropose
