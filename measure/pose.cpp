#include "measure/pose.h"

#include <algorithm>
#include <cmath>

#include "calib/symmetric_eigen.h"
#include "calib/words.h"
#include "measure/pose_rejection.h"
#include "measure/pose_solver.h"
#include "measure/pose_start.h"

namespace zeropose {
namespace {

// A start whose estimate leaves larger deviations (rad, root mean square) ended in a wrong valley.
constexpr double plausible_rms_rad = 0.005;
constexpr std::size_t max_starts = 6;

bool is_number_above_zero(double value) { return std::isfinite(value) && value > 0; }
bool is_number_not_below_zero(double value) { return std::isfinite(value) && value >= 0; }

bool valid(const CalibratedCamera& camera) {
  const CameraModel& model = camera.model;
  return is_number_above_zero(model.fx_px) && is_number_above_zero(model.fy_px) &&
         std::isfinite(model.cx_px) && std::isfinite(model.cy_px) && camera.X_WC.matrix().allFinite();
}

bool valid(const Mark& mark) {
  return mark.p_O_mm.allFinite() && mark.normal_O.allFinite() && is_number_not_below_zero(mark.radius_mm) &&
         is_number_not_below_zero(mark.weight) && mark.weight <= 1 && mark.tolerance_px >= 0 &&
         mark.tolerance_mm >= 0 && is_number_not_below_zero(mark.sigma_mm);
}

bool valid(const Eigen::Matrix2d& covariance) {
  return covariance.allFinite() && covariance(0, 0) > 0 && covariance(1, 1) > 0 &&
         covariance.determinant() > 0 &&
         std::abs(covariance(0, 1) - covariance(1, 0)) <= 1e-9 * covariance.trace();
}

// What is wrong with an observation's numbers, or nothing.
std::string fault_of(const PoseProblem& problem, const Observation& observation) {
  if (observation.camera >= problem.cameras.size()) return "names a camera that does not exist";
  if (observation.mark >= problem.marks.size()) return "names a mark that does not exist";
  if (!observation.u_px.allFinite()) return "has a pixel that is not finite";
  if (!valid(observation.covariance_px2)) return "has a covariance that is not positive definite";
  if (!valid(problem.cameras[observation.camera]))
    return "comes from a camera whose calibration is not usable";
  if (!valid(problem.marks[observation.mark])) return "belongs to a mark whose numbers are not usable";
  return {};
}

// What is wrong with the numbers of the problem, or nothing.
std::string fault_of(const PoseProblem& problem) {
  if (!is_number_not_below_zero(problem.system_sigma_px)) return "the system's sigma is not a number >= 0";
  for (const auto* pose : {&problem.X_WO_start, &problem.X_WP_planar})
    if (*pose && !(*pose)->matrix().allFinite()) return "a given pose is not finite";
  for (std::size_t i = 0; i < problem.observations.size(); ++i)
    if (const std::string fault = fault_of(problem, problem.observations[i]); !fault.empty())
      return "observation " + number(i + 1) + " (from 1) " + fault;
  return {};
}

struct Count {
  int marks = 0, cameras = 0, observations = 0;
};

Count count_active(const PoseModel& model, const PoseProblem& problem) {
  std::vector<bool> marks(problem.marks.size()), cameras(problem.cameras.size());
  Count count;
  for (const Sight& sight : model.sights()) {
    if (!sight.active) continue;
    ++count.observations;
    count.marks += !marks[sight.mark_index];
    count.cameras += !cameras[sight.camera_index];
    marks[sight.mark_index] = cameras[sight.camera_index] = true;
  }
  return count;
}

bool plausible(const PoseModel& model) {
  double sum = 0;
  int count = 0;
  for (const Sight& sight : model.sights()) {
    if (!sight.active) continue;
    sum += (sight.dev_px / sight.camera->fx_px).squaredNorm();
    ++count;
  }
  return sum <= plausible_rms_rad * plausible_rms_rad * count;
}

bool same_place(const PoseModel& model, const CentredPose& a, const CentredPose& b) {
  return (a.p_WM_mm - b.p_WM_mm).norm() + model.extent_mm() * (a.R_WO - b.R_WO).norm() <
         1e-3 * model.extent_mm();
}

struct Found {
  Estimate estimate;
  int equally_good = 1;        // poses that explain the marks as well as this one
  bool position_open = false;  // no start: the directions of sight are parallel
};

// The best of several starts.
Found estimate_from_anywhere(PoseModel& model, const Estimate& first) {
  const auto starts = start_poses(model, max_starts);
  if (!starts) return {first, 1, first.solution.status == SolverStatus::failed};
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
  if (estimates.empty()) return {failed, 1};
  const auto best = std::min_element(estimates.begin(), estimates.end(), [](const auto& a, const auto& b) {
    return a.solution.equations.cost < b.solution.equations.cost;
  });
  const auto equal = std::count_if(estimates.begin(), estimates.end(), [best](const Estimate& estimate) {
    return std::abs(estimate.misfit - best->misfit) < equal_misfit;
  });
  return {estimate(model, best->solution.pose), static_cast<int>(equal)};
}

Found find_pose(PoseModel& model, const std::optional<Pose>& X_WO_start) {
  Estimate first;
  if (X_WO_start) {
    first = estimate(model, model.centred(*X_WO_start));
    if (first.solution.status == SolverStatus::singular || (first.ok() && plausible(model)))
      return {std::move(first), 1};
  }
  return estimate_from_anywhere(model, first);
}

std::string words_of(const Eigen::Vector3d& v) {
  return std::string("(").append(number(v.x())) + " " + number(v.y()) + " " + number(v.z()) + ")";
}

std::string why_degenerate(const PoseModel& model, const Precision& precision) {
  Eigen::Matrix3d spread = Eigen::Matrix3d::Zero();
  for (const Sight& sight : model.sights())
    if (sight.active) spread += sight.p_MQ_mm * sight.p_MQ_mm.transpose();
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
  const Eigen::Vector3d shift = precision.weakest.head<3>(), turn = precision.weakest.tail<3>();
  if (shift.norm() > turn.norm())
    return "the marks leave the position along " + words_of(shift.normalized()) +
           " of the world open: " + numbers;
  return "the marks leave the rotation about " + words_of(turn.normalized()) +
         " of the world open: " + numbers;
}

void fill_deviations(const PoseModel& model, const Estimate& estimate, PoseResult& result) {
  for (std::size_t i = 0; i < model.sights().size(); ++i) {
    const Sight& sight = model.sights()[i];
    Deviation& deviation = result.deviations.emplace_back();
    deviation.used = sight.active;
    if (!sight.visible) {
      deviation.dev_px.setConstant(no_tolerance);
      deviation.dev_mm.setConstant(no_tolerance);
      deviation.normalised = no_tolerance;
      continue;
    }
    const Eigen::Vector2d focal_px(sight.camera->fx_px, sight.camera->fy_px);
    deviation.dev_px = sight.dev_px;
    deviation.dev_mm = sight.dev_px.cwiseQuotient(focal_px) * sight.depth_mm;
    deviation.normalised = estimate.normalised[i];
  }
  for (const std::size_t i : result.removed) result.deviations[i].removed = true;
}

// The covariance about M as one about O: dp_O = dp_M + [c]x dr with c from O to M, axes of W.
Matrix6 about_origin(const PoseModel& model, const CentredPose& pose, const Matrix6& covariance) {
  const Eigen::Matrix3d S = cross_matrix(pose.R_WO * model.centroid_O_mm());
  const Eigen::Matrix3d turn = covariance.bottomRightCorner<3, 3>();
  const Eigen::Matrix3d mixed = covariance.topRightCorner<3, 3>() + S * turn;
  Matrix6 about_O;
  about_O.topLeftCorner<3, 3>() =
      covariance.topLeftCorner<3, 3>() + S * covariance.bottomLeftCorner<3, 3>() + mixed * S.transpose();
  about_O.topRightCorner<3, 3>() = mixed;
  about_O.bottomLeftCorner<3, 3>() = mixed.transpose();
  about_O.bottomRightCorner<3, 3>() = turn;
  return about_O;
}

void fill_result(const PoseModel& model, const PoseProblem& problem, const Estimate& estimate,
                 PoseResult& result) {
  const Count count = count_active(model, problem);
  result.effective_marks = count.marks;
  result.effective_cameras = count.cameras;
  result.redundancy = 2 * count.observations - model.unknowns();
  result.condition = estimate.precision.condition;
  if (estimate.solution.status != SolverStatus::converged) return;
  result.X_WO = model.pose(estimate.solution.pose);
  fill_deviations(model, estimate, result);
  result.covariance = about_origin(model, estimate.solution.pose, estimate.precision.covariance);
  result.total_covariance = about_origin(model, estimate.solution.pose, estimate.precision.total_covariance);
}

PoseResult failed(Code code, std::string reason) {
  PoseResult result;
  result.code = code;
  result.reason = std::move(reason);
  return result;
}

// Why an estimate cannot be used, or ok.
Code fault_of(const PoseModel& model, const Found& found, std::string& reason) {
  const Solution& solution = found.estimate.solution;
  if (found.equally_good > 1) {
    reason = number(found.equally_good) + " different poses explain the " + number(model.active_count()) +
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
    reason = why_degenerate(model, found.estimate.precision);
    return Code::geometry_degenerate;
  }
  const bool tried =
      solution.status == SolverStatus::not_converged || solution.status == SolverStatus::singular;
  const Precision precision = tried ? precision_of(model, solution) : Precision{};
  if (tried && !precision.determined) {
    reason = why_degenerate(model, precision);
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
  Found found = find_pose(model, problem.X_WO_start);
  PoseResult result;
  result.code = fault_of(model, found, result.reason);
  if (result.code == Code::ok && problem.reject_wrong_marks) {
    Rejection rejection = reject_wrong_marks(model, found.estimate);
    result.code = rejection.code;
    result.reason = std::move(rejection.reason);
    result.removed = std::move(rejection.removed);
    found.estimate = std::move(rejection.estimate);
  }
  fill_result(model, problem, found.estimate, result);
  return result;
}

}  // namespace zeropose
