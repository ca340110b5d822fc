#include "measure/gap_evening.h"

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <memory>

#include "calib/point_fit.h"
#include "calib/symmetric_eigen.h"
#include "calib/words.h"

namespace zeropose {
namespace {

using Eigen::MatrixXd;
using Eigen::Vector2d;
using Eigen::Vector3d;
using Eigen::VectorXd;

constexpr int most_rounds = 20;
constexpr double smallest_step_mm = 1e-9;

// The gap after the pane has turned about a point and then shifted, with its derivatives. The frame's edge is
// straight and then parallel to the pane's, which the camera goes with.
struct MovedGap {
  double gap_mm = 0;
  Vector2d by_shift;
  double by_turn = 0;  // mm per rad
};

MovedGap moved_gap(const PaneGap& gap, const Vector2d& about_T_mm, double rz_rad, const Vector2d& shift_mm) {
  const Vector2d arm = gap.p_T_mm - about_T_mm, n = Eigen::Rotation2Dd(rz_rad) * gap.outward_T;
  const double in_plane = n.squaredNorm();
  MovedGap out;
  out.gap_mm =
      gap.gap_mm * (1 - in_plane * (1 - std::cos(rz_rad))) + n.dot(arm - shift_mm) - gap.outward_T.dot(arm);
  out.by_shift = -n;
  out.by_turn = Vector2d(-n.y(), n.x()).dot(arm - shift_mm) - gap.gap_mm * in_plane * std::sin(rz_rad);
  return out;
}

// Unknowns: shift of the pane at the gaps' centre, turn about it times the gaps' reach (all mm), common gap.
struct Layout {
  Vector2d centre_T_mm = Vector2d::Zero();
  double reach_mm = 1;  // root mean square distance from the centre
  bool even = true;

  Eigen::Index unknowns() const { return even ? 4 : 3; }
  double turn_rad(const VectorXd& x) const { return x(2) / reach_mm; }

  struct Row {
    double off_mm;  // from what is wanted
    VectorXd J;     // of the unknowns that take it away
  };
  Row row(const PaneGap& gap, const VectorXd& x) const {
    const MovedGap moved = moved_gap(gap, centre_T_mm, turn_rad(x), x.head<2>());
    Row row{moved.gap_mm - gap.wanted_mm - (even ? x(3) : 0), VectorXd::Ones(unknowns())};
    row.J.head<3>() << -moved.by_shift, -moved.by_turn / reach_mm;
    return row;
  }
  // Of the shift at T's origin, the turn and the common gap by the unknowns.
  MatrixXd to_result(const VectorXd& x) const {
    MatrixXd J = MatrixXd::Identity(unknowns(), unknowns());
    const Vector2d turned = Eigen::Rotation2Dd(turn_rad(x)) * centre_T_mm;
    J.block<3, 1>(0, 2) = Vector3d(turned.y(), -turned.x(), 1) / reach_mm;
    return J;
  }
};

double variance_of(const EveningProblem& problem, const PaneGap& gap) {
  return gap.sigma_mm * gap.sigma_mm + problem.shape_sigma_mm * problem.shape_sigma_mm;
}

Layout layout_of(const EveningProblem& problem) {
  Layout layout;
  layout.even = problem.even;
  double count = 0, squares = 0;
  for (const PaneGap& gap : problem.gaps) {
    if (gap.weight == 0) continue;
    layout.centre_T_mm += gap.p_T_mm;
    count += 1;
  }
  layout.centre_T_mm /= count;
  for (const PaneGap& gap : problem.gaps)
    if (gap.weight > 0) squares += (gap.p_T_mm - layout.centre_T_mm).squaredNorm();
  layout.reach_mm = std::max(1.0, std::sqrt(squares / count));
  return layout;
}

// One row for each gap, without the users' weights: what tells whether they agree.
class GapEquations : public PointEquations {
 public:
  GapEquations(const EveningProblem& problem, const Layout& layout)
      : problem_(problem), layout_(layout), at_(VectorXd::Zero(layout.unknowns())) {}

  std::unique_ptr<PointEquations> copy() const override { return std::make_unique<GapEquations>(*this); }
  Eigen::Index unknowns() const override { return layout_.unknowns(); }
  std::size_t points() const override { return problem_.gaps.size(); }
  Eigen::Index rows_per_point() const override { return 1; }
  bool linearise(std::size_t point, PointRows& rows) const override {
    const PaneGap& gap = problem_.gaps[point];
    const Layout::Row row = layout_.row(gap, at_);
    const double scale = 1 / std::sqrt(variance_of(problem_, gap));
    rows.r = VectorXd::Constant(1, scale * row.off_mm);
    rows.J = scale * row.J.transpose();
    return true;
  }
  void move(const VectorXd& delta) override { at_ += delta; }

 private:
  const EveningProblem& problem_;
  const Layout& layout_;
  VectorXd at_;
};

EveningResult& refused(EveningResult& result, Code code, std::string reason) {
  result.code = code;
  result.reason = std::move(reason);
  return result;
}

std::string title(const EveningProblem& problem, std::size_t gap) {
  const std::string& name = problem.gaps[gap].name;
  return name.empty() ? number(gap + 1) + " (from 1)" : name;
}

std::string titles(const EveningProblem& problem, const std::vector<std::size_t>& gaps) {
  std::string text;
  for (const std::size_t gap : gaps) text += (text.empty() ? "" : ", ") + title(problem, gap);
  return text;
}

// ---- what is wrong with the problem

std::string fault_of(const PaneGap& gap) {
  if (!gap.p_T_mm.allFinite() || !std::isfinite(gap.gap_mm) || !std::isfinite(gap.wanted_mm))
    return "has a number that is not finite";
  if (!std::isfinite(gap.sigma_mm) || !(gap.sigma_mm > 0)) return "has a sigma that is not positive";
  if (!(gap.weight >= 0 && gap.weight <= 1)) return "has a weight of " + number(gap.weight) + ", not 0 to 1";
  const double length = gap.outward_T.norm();
  if (!(length > 0 && length < 1 + 1e-6))
    return "has an outward direction of length " + number(length, 4) + ", not above 0 and up to 1";
  return {};
}

std::string fault_of_limits(const EveningProblem& problem) {
  const auto positive = [](double x) { return std::isfinite(x) && x > 0; };
  if (!positive(problem.max_x_mm) || !positive(problem.max_y_mm) || !positive(problem.max_rz_rad))
    return "the motion's limits must be positive";
  if (!positive(problem.tolerance_mm)) return "the tolerance must be positive";
  if (!(problem.shape_sigma_mm >= 0) || !std::isfinite(problem.shape_sigma_mm))
    return "the shape's sigma must be a number >= 0";
  return {};
}

// True: refused.
bool refuse_faults(const EveningProblem& problem, EveningResult& result) {
  if (std::string fault = fault_of_limits(problem); !fault.empty())
    return refused(result, Code::argument_out_of_range, std::move(fault)), true;
  std::size_t count = 0;
  for (std::size_t i = 0; i < problem.gaps.size(); ++i) {
    if (const std::string fault = fault_of(problem.gaps[i]); !fault.empty())
      return refused(result, Code::marks_invalid, "gap " + title(problem, i) + " " + fault), true;
    count += problem.gaps[i].weight > 0 ? 1 : 0;
  }
  const std::size_t least = problem.even ? 4 : 3;
  if (count >= least) return false;
  refused(result, Code::too_few_marks,
          number(count) + " gaps with a weight, " +
              (problem.even ? "evening needs 4 (x, y, rz and the common gap), or 3 with wanted gaps"
                            : "x, y and rz need 3"));
  return true;
}

// ---- a motion that the gaps leave open

std::string motion_text(const Layout& layout, const VectorXd& v) {
  const Vector2d shift = v.head<2>();
  const double turn = v(2) / layout.reach_mm;
  std::string text;
  if (std::abs(v(2)) < 0.1) {
    if (shift.norm() < 0.1) return "the common gap";
    const Vector2d along = shift.normalized() * (shift.cwiseAbs().maxCoeff() == shift.maxCoeff() ? 1 : -1);
    text = "a shift along (" + number(along.x()) + ", " + number(along.y()) + ") of the pane's frame";
  } else {
    const Vector2d about = layout.centre_T_mm + Vector2d(-shift.y(), shift.x()) / turn;
    text = "a turn about (" + number(about.x(), 0) + ", " + number(about.y(), 0) + ") mm of the pane's frame";
  }
  return layout.even && std::abs(v(3)) > 0.1 ? text + " together with the common gap" : text;
}

bool refuse_open_motion(const EveningProblem& problem, const Layout& layout, const std::vector<bool>& used,
                        EveningResult& result) {
  MatrixXd N = MatrixXd::Zero(layout.unknowns(), layout.unknowns());
  double count = 0;
  for (std::size_t i = 0; i < used.size(); ++i) {
    if (!used[i]) continue;
    const VectorXd J = layout.row(problem.gaps[i], VectorXd::Zero(layout.unknowns())).J;
    N += J * J.transpose();
    count += 1;
  }
  const SymmetricEigen eigen = symmetric_eigen(N / count);
  const double effect = std::sqrt(std::max(0.0, eigen.values(0)));
  if (effect >= evening_least_effect) return false;
  refused(
      result, Code::geometry_degenerate,
      std::string(result.removed.empty() ? "the gaps" : "without the gap that contradicts them the gaps") +
          " leave open " + motion_text(layout, eigen.vectors.col(0)) + ": 1 mm of it changes them by " +
          number(effect, 4) + " mm (root mean square); measure gaps on other sides" +
          (problem.even ? ", or give wanted gaps" : ""));
  return true;
}

// ---- estimate

// False: the gaps contradict each other.
bool find_wrong_gaps(const EveningProblem& problem, const Layout& layout, std::vector<bool>& used,
                     EveningResult& result) {
  WrongPointOptions options;
  options.sigma_px = 1;  // the residuals are whitened
  options.least_redundancy = 1;
  PointFit all = fit_points(GapEquations(problem, layout), used);
  if (all.status != PointFitStatus::ok) {
    refused(result, Code::geometry_degenerate, "the gaps do not determine the motion");
    return false;
  }
  const double squares = all.cost;
  const WrongPoints wrong = remove_wrong_points(std::move(all), used, options);
  result.redundancy = wrong.fit.redundancy;
  result.removed = wrong.removed;
  result.suspects = wrong.suspects;
  if (wrong.agree) return true;
  const int redundancy = result.redundancy + static_cast<int>(result.removed.size());
  refused(result, Code::deviation_not_attributable,
          "the gaps contradict each other " + number(std::sqrt(squares / std::max(1, redundancy)), 1) +
              " times more than their sigmas allow" +
              (wrong.suspects.empty() ? std::string(", and no single one is known to be wrong")
                                      : ", wrong is one of " + titles(problem, wrong.suspects)));
  return false;
}

struct WeightedSums {
  MatrixXd N, M;  // M: what the gaps' sigmas make of g
  VectorXd g;
};

WeightedSums sums_at(const EveningProblem& problem, const Layout& layout, const std::vector<bool>& used,
                     const VectorXd& x) {
  const Eigen::Index n = layout.unknowns();
  WeightedSums sums{MatrixXd::Zero(n, n), MatrixXd::Zero(n, n), VectorXd::Zero(n)};
  for (std::size_t i = 0; i < used.size(); ++i) {
    if (!used[i]) continue;
    const PaneGap& gap = problem.gaps[i];
    const Layout::Row row = layout.row(gap, x);
    const double W = gap.weight / variance_of(problem, gap);
    sums.N += W * row.J * row.J.transpose();
    sums.M += W * W * gap.sigma_mm * gap.sigma_mm * row.J * row.J.transpose();
    sums.g += W * row.off_mm * row.J;
  }
  return sums;
}

// Weighted with the users' weights as well; the covariance knows the gaps' true variances.
void estimate(const EveningProblem& problem, const Layout& layout, const std::vector<bool>& used,
              EveningResult& result) {
  VectorXd x = VectorXd::Zero(layout.unknowns()), step = x;
  WeightedSums sums = sums_at(problem, layout, used, x);
  for (int round = 0; round < most_rounds; ++round) {
    step = Eigen::LDLT<MatrixXd>(sums.N).solve(sums.g);
    x += step;
    sums = sums_at(problem, layout, used, x);
    if (step.norm() < smallest_step_mm) break;
  }
  const Vector2d turned = Eigen::Rotation2Dd(layout.turn_rad(x)) * layout.centre_T_mm;
  const Vector2d shift = x.head<2>() + layout.centre_T_mm - turned;
  result.x_mm = shift.x();
  result.y_mm = shift.y();
  result.rz_rad = layout.turn_rad(x);
  const MatrixXd J =
      layout.to_result(x) * Eigen::LDLT<MatrixXd>(sums.N).solve(MatrixXd::Identity(x.size(), x.size()));
  const MatrixXd C = J * sums.M * J.transpose();
  result.covariance = C.topLeftCorner<3, 3>();
  if (!problem.even) return;
  result.common_mm = x(3);
  result.common_sigma_mm = std::sqrt(C(3, 3));
}

// The largest deviation from the common gap and from what is wanted.
double worst_of(const EveningProblem& problem, const std::vector<bool>& used,
                const std::vector<double>& gaps_mm, double common_mm) {
  double worst = 0;
  for (std::size_t i = 0; i < used.size(); ++i)
    if (used[i]) worst = std::max(worst, std::abs(gaps_mm[i] - problem.gaps[i].wanted_mm - common_mm));
  return worst;
}

// Halfway between the widest and the narrowest, each less what is wanted.
double middle_of(const EveningProblem& problem, const std::vector<bool>& used) {
  double low = INFINITY, high = -INFINITY;
  for (std::size_t i = 0; i < used.size(); ++i) {
    if (!used[i]) continue;
    low = std::min(low, problem.gaps[i].gap_mm - problem.gaps[i].wanted_mm);
    high = std::max(high, problem.gaps[i].gap_mm - problem.gaps[i].wanted_mm);
  }
  return problem.even ? 0.5 * (low + high) : 0;
}

void predict(const EveningProblem& problem, const std::vector<bool>& used, EveningResult& result) {
  const Vector2d shift(result.x_mm, result.y_mm);
  result.predicted_mm.clear();
  for (const PaneGap& gap : problem.gaps)
    result.predicted_mm.push_back(moved_gap(gap, Vector2d::Zero(), result.rz_rad, shift).gap_mm);
  result.predicted_worst_mm = worst_of(problem, used, result.predicted_mm, result.common_mm);
  result.X_TTn.translation() = Vector3d(shift.x(), shift.y(), 0);
  result.X_TTn.linear() = exp_so3(Vector3d(0, 0, result.rz_rad));
}

// True: within the tolerance as they are, and the motion is zero.
bool stand_still(const EveningProblem& problem, const std::vector<bool>& used, EveningResult& result) {
  std::vector<double> now;
  for (const PaneGap& gap : problem.gaps) now.push_back(gap.gap_mm);
  const double middle = middle_of(problem, used);
  result.worst_mm = worst_of(problem, used, now, middle);
  if (result.worst_mm > problem.tolerance_mm) return false;
  result.even_already = true;
  result.common_mm = middle;
  result.code = Code::ok;
  predict(problem, used, result);
  return true;
}

EveningResult& judge_limits(const EveningProblem& problem, EveningResult& result) {
  const auto beyond = [](const char* axis, double value, double limit, const char* unit) {
    return std::string("the pane would have to move by ") + axis + " = " + number(value, 3) + " " + unit +
           ", at most " + number(limit, 3) + " " + unit + " are allowed";
  };
  if (std::abs(result.x_mm) > problem.max_x_mm)
    return refused(result, Code::limit_x, beyond("x", result.x_mm, problem.max_x_mm, "mm"));
  if (std::abs(result.y_mm) > problem.max_y_mm)
    return refused(result, Code::limit_y, beyond("y", result.y_mm, problem.max_y_mm, "mm"));
  if (std::abs(result.rz_rad) > problem.max_rz_rad)
    return refused(
        result, Code::limit_rz,
        beyond("rz", result.rz_rad * degrees_per_radian, problem.max_rz_rad * degrees_per_radian, "deg"));
  result.code = Code::ok;
  return result;
}

}  // namespace

EveningResult even_gaps(const EveningProblem& problem) {
  EveningResult result;
  if (refuse_faults(problem, result)) return result;
  const Layout layout = layout_of(problem);
  std::vector<bool> used;
  for (const PaneGap& gap : problem.gaps) used.push_back(gap.weight > 0);
  if (refuse_open_motion(problem, layout, used, result) || stand_still(problem, used, result)) return result;
  if (!find_wrong_gaps(problem, layout, used, result)) return result;
  if (!result.removed.empty() &&
      (refuse_open_motion(problem, layout, used, result) || stand_still(problem, used, result)))
    return result;
  estimate(problem, layout, used, result);
  predict(problem, used, result);
  return judge_limits(problem, result);
}

}  // namespace zeropose
