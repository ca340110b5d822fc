#include "measure/pose.h"

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "calib/symmetric_eigen.h"
#include "calib/words.h"
#include "measure/pose_checks.h"
#include "measure/pose_rejection.h"
#include "measure/pose_solver.h"
#include "measure/pose_start.h"

namespace zeropose {
namespace {

// A start whose estimate leaves larger deviations (rad, root mean square) ended in a wrong valley.
constexpr double plausible_rms_rad = 0.005;
// Wrong marks may leave as much as this.
constexpr double explicable_rms_rad = 0.03;
constexpr std::size_t max_starts = 6;

// Counts different numbers below a bound; up to 64 of them cost no memory.
class Distinct {
 public:
  explicit Distinct(std::size_t bound) : large_(bound > 64 ? bound : 0) {}

  void add(std::size_t number) {
    if (!large_.empty()) {
      count_ += !large_[number];
      large_[number] = true;
      return;
    }
    const std::uint64_t bit = std::uint64_t{1} << number;
    count_ += (small_ & bit) == 0;
    small_ |= bit;
  }
  int count() const { return count_; }

 private:
  std::uint64_t small_ = 0;
  std::vector<bool> large_;
  int count_ = 0;
};

struct Count {
  int marks = 0, cameras = 0, observations = 0;
};

Count count_active(const PoseModel& model, const PoseProblem& problem) {
  Distinct marks(problem.marks.size()), cameras(problem.cameras.size());
  Count count;
  for (std::size_t i = 0; i < model.size(); ++i) {
    if (!model.active(i)) continue;
    ++count.observations;
    marks.add(model.observation(i).mark);
    cameras.add(model.observation(i).camera);
  }
  count.marks = marks.count();
  count.cameras = cameras.count();
  return count;
}

bool same_place(const PoseModel& model, const CentredPose& a, const CentredPose& b) {
  return (a.p_WM_mm - b.p_WM_mm).norm() + model.extent_mm() * (a.R_WO - b.R_WO).norm() <
         1e-3 * model.extent_mm();
}

struct Found {
  Estimate estimate;
  std::vector<CentredPose> branches{};   // when several poses explain the marks equally well: all, best first
  bool position_open = false;            // no start: the directions of sight are parallel
  std::optional<Rejection> rejection{};  // wrong marks were looked for already
};

// The best of several starts.
Found estimate_from_anywhere(PoseModel& model, const Estimate& first) {
  const auto starts = start_poses(model, max_starts);
  if (!starts) return {first, {}, first.solution.status == SolverStatus::failed};
  std::vector<Estimate> estimates;
  if (first.ok()) estimates.push_back(first);
  Estimate failed = first;
  for (const CentredPose& start : *starts) {
    Estimate next = estimate(model, start);
    if (!next.ok()) {
      if (failed.solution.status != SolverStatus::converged) failed = next;
      continue;
    }
    const bool known = std::any_of(estimates.begin(), estimates.end(), [&](const Estimate& estimate) {
      return same_place(model, estimate.solution.pose, next.solution.pose);
    });
    if (!known) estimates.push_back(std::move(next));
  }
  if (estimates.empty()) return {failed};
  std::stable_sort(estimates.begin(), estimates.end(),
                   [](const Estimate& a, const Estimate& b) { return a.misfit < b.misfit; });
  Found found{estimate(model, estimates.front().solution.pose)};
  for (const Estimate& estimate : estimates)
    if (estimate.misfit - estimates.front().misfit < equal_misfit)
      found.branches.push_back(estimate.solution.pose);
  if (found.branches.size() == 1) found.branches.clear();
  return found;
}

// From the start. Where that leaves large deviations it ended in a wrong valley, or marks are wrong: if
// without some of them all others agree it was that.
Found find_pose(PoseModel& model, const PoseProblem& problem) {
  Estimate first;
  if (problem.X_WO_start) {
    first = estimate(model, model.centred(*problem.X_WO_start));
    if (first.solution.status == SolverStatus::singular) return {std::move(first)};
    const double rms = first.ok() ? model.rms_rad() : no_tolerance;
    if (rms <= plausible_rms_rad) return {std::move(first)};
    if (problem.reject_wrong_marks && rms <= explicable_rms_rad) {
      Found found{first};
      found.rejection = reject_wrong_marks(model, found.estimate);
      if (found.rejection->explained) return found;
    }
  }
  return estimate_from_anywhere(model, first);
}

std::string words_of(const Eigen::Vector3d& v) {
  return std::string("(").append(number(v.x())) + " " + number(v.y()) + " " + number(v.z()) + ")";
}

std::string why_degenerate(const PoseModel& model, const Matrix6& N, const Precision& precision) {
  Eigen::Matrix3d spread = Eigen::Matrix3d::Zero();
  for (std::size_t i = 0; i < model.size(); ++i)
    if (model.active(i)) spread += model.p_MQ_mm(i) * model.p_MQ_mm(i).transpose();
  const Eigen::Vector3d squares = symmetric_eigen(spread).values;
  const double count = std::max(1, model.active_count());
  const double along = std::sqrt(std::max(0.0, squares(2)) / count);
  const double across = std::sqrt(std::max(0.0, squares(0) + squares(1)) / count);
  const std::string numbers = "condition " + number(precision.condition, 1) + ", sigma " +
                              number(precision.weakest_sigma_mm, 1) + " mm at " +
                              number(model.extent_mm(), 0) + " mm from the middle";
  if (across <= 1e-2 * along)
    return "the marks lie on a line: " + number(across) + " mm across over " + number(along) +
           " mm along (root mean square), " + numbers;
  const Vector6 weakest = weakest_direction(model, N);
  const Eigen::Vector3d shift = weakest.head<3>(), turn = weakest.tail<3>();
  if (shift.norm() > turn.norm())
    return "the marks leave the position along " + words_of(shift.normalized()) +
           " of the world open: " + numbers;
  return "the marks leave the rotation about " + words_of(turn.normalized()) +
         " of the world open: " + numbers;
}

void fill_deviations(const PoseModel& model, PoseResult& result) {
  result.deviations.resize(model.size());
  for (std::size_t i = 0; i < model.size(); ++i) {
    Deviation& deviation = result.deviations[i];
    deviation.used = model.active(i);
    if (model.visible(i)) {
      deviation.dev_px = model.dev_px(i);
      deviation.dev_mm = model.dev_mm(i);
    } else {
      deviation.dev_px.setConstant(no_tolerance);
      deviation.dev_mm.setConstant(no_tolerance);
    }
    deviation.normalised = model.normalised(i);
  }
  for (const std::size_t i : result.removed) result.deviations[i].removed = true;
}

// The covariance about M, rotations in mm at the extent, as one about O: dp_O = dp_M + [c]x dr with c from O
// to M, axes of W.
Matrix6 about_origin(const PoseModel& model, const CentredPose& pose, const Matrix6& covariance) {
  const Eigen::Matrix3d S = cross_matrix(pose.R_WO * model.centroid_O_mm());
  const double share = 1 / model.extent_mm();
  const Eigen::Matrix3d turn = share * share * covariance.bottomRightCorner<3, 3>();
  const Eigen::Matrix3d both = share * covariance.topRightCorner<3, 3>();
  const Eigen::Matrix3d mixed = both + S * turn;
  Matrix6 about_O;
  about_O.topLeftCorner<3, 3>() =
      covariance.topLeftCorner<3, 3>() + S * both.transpose() + mixed * S.transpose();
  about_O.topRightCorner<3, 3>() = mixed;
  about_O.bottomLeftCorner<3, 3>() = mixed.transpose();
  about_O.bottomRightCorner<3, 3>() = turn;
  return about_O;
}

void fill_result(const PoseModel& model, const Count& count, const Found& found, PoseResult& result) {
  const Estimate& estimate = found.estimate;
  result.effective_marks = count.marks;
  result.effective_cameras = count.cameras;
  result.redundancy = 2 * count.observations - model.unknowns();
  result.condition = estimate.precision.condition;
  if (estimate.solution.status != SolverStatus::converged) return;
  const CentredPose& pose = estimate.solution.pose;
  result.X_WO = model.pose(pose);
  for (const CentredPose& branch : found.branches) result.alternatives.push_back(model.pose(branch));
  fill_deviations(model, result);
  result.covariance = about_origin(model, pose, estimate.precision.covariance);
  result.total_covariance =
      model.plain() ? result.covariance : about_origin(model, pose, estimate.precision.total_covariance);
}

PoseResult failed(Code code, std::string reason) {
  PoseResult result;
  result.code = code;
  result.reason = std::move(reason);
  return result;
}

// Why an estimate cannot be used, or ok.
Code fault_of(PoseModel& model, const Found& found, std::string& reason) {
  const Solution& solution = found.estimate.solution;
  if (!found.branches.empty()) {
    reason = number(found.branches.size()) + " different poses explain the " + number(model.active_count()) +
             " observations equally well";
    return Code::geometry_degenerate;
  }
  if (found.position_open) {
    reason = "all " + number(model.active_count()) +
             " directions of sight are parallel, they leave the position along them open";
    return Code::geometry_degenerate;
  }
  if (solution.status == SolverStatus::converged) {
    if (found.estimate.precision.determined) return Code::ok;
    reason = why_degenerate(model, solution.equations.N, found.estimate.precision);
    return Code::geometry_degenerate;
  }
  const bool tried =
      solution.status == SolverStatus::not_converged || solution.status == SolverStatus::singular;
  const Precision precision = tried ? precision_of(model, solution) : Precision{};
  if (tried && !precision.determined) {
    reason = why_degenerate(model, solution.equations.N, precision);
    return Code::geometry_degenerate;
  }
  reason =
      "no pose was found from which all " + number(model.active_count()) + " observations can be explained";
  return Code::not_converged;
}

}  // namespace

PoseResult estimate_pose(const PoseProblem& problem) {
  if (std::string fault = fault_of(problem); !fault.empty())
    return failed(Code::marks_invalid, std::move(fault));
  PoseModel model(problem);
  const Count count = count_active(model, problem);
  const int needed = model.planar() ? 2 : 3;
  if (count.marks < needed)
    return failed(Code::too_few_marks,
                  number(count.marks) + " marks with a weight were found, a pose needs " + number(needed));
  Found found = find_pose(model, problem);
  PoseResult result;
  result.code = fault_of(model, found, result.reason);
  if (result.code == Code::ok && problem.reject_wrong_marks) {
    Rejection rejection =
        found.rejection ? std::move(*found.rejection) : reject_wrong_marks(model, found.estimate);
    result.code = rejection.code;
    result.reason = std::move(rejection.reason);
    result.removed = std::move(rejection.removed);
  }
  fill_result(model, result.removed.empty() ? count : count_active(model, problem), found, result);
  return result;
}

}  // namespace zeropose
