#include "measure/association.h"

#include <Eigen/LU>
#include <cmath>
#include <limits>

#include "measure/measurement.h"
#include "measure/pose.h"

namespace zeropose {
namespace {

constexpr std::size_t most_choices = 64;
constexpr double most_sigmas = 4;
constexpr double least_advantage = 13.8;  // of the sum of squares: likelihood ratio of a thousand

// How well one pose explains the findings: whitened sum of squares, infinite where it does not.
double misfit_of(const Job& job, std::span<const CalibratedCamera> cameras,
                 std::span<const MarkFinding> findings, const Pose& X_WO_start, int least_redundancy) {
  constexpr double none = std::numeric_limits<double>::infinity();
  const std::vector<Observation> observations = observations_of(findings, job);
  PoseProblem problem;
  problem.cameras = cameras;
  problem.marks = job.marks;
  problem.observations = observations;
  problem.X_WO_start = X_WO_start;
  problem.X_WP_planar = job.X_WP_planar;
  problem.system_sigma_px = job.system_sigma_px;
  problem.reject_wrong_marks = false;
  const PoseResult pose = estimate_pose(problem);
  if (pose.code != Code::ok || pose.redundancy < least_redundancy) return none;
  double sum = 0;
  for (std::size_t i = 0; i < observations.size(); ++i) {
    const Mark& mark = job.marks[observations[i].mark];
    const Deviation& deviation = pose.deviations[i];
    if (!deviation.used) continue;
    const double px_per_mm = deviation.dev_px.norm() / std::max(1e-12, deviation.dev_mm.norm());
    const double sigma_px = std::hypot(job.system_sigma_px, mark.sigma_mm * px_per_mm);
    const Eigen::Matrix2d S =
        observations[i].covariance_px2 + sigma_px * sigma_px * Eigen::Matrix2d::Identity();
    const double square = deviation.dev_px.dot(S.inverse() * deviation.dev_px);
    if (!(square <= most_sigmas * most_sigmas && deviation.normalised <= most_sigmas)) return none;
    sum += square;
  }
  return sum;
}

}  // namespace

std::vector<MarkFinding> decided_by_geometry(const Job& job, std::span<const CalibratedCamera> cameras,
                                             std::vector<MarkFinding> findings,
                                             std::span<const std::vector<MarkFinding>> candidates,
                                             const Pose& X_WO_start) {
  std::vector<std::size_t> open;
  std::size_t choices = 1;
  for (std::size_t i = 0; i < findings.size(); ++i) {
    if (findings[i].status != MarkStatus::ambiguous || candidates[i].size() < 2) continue;
    open.push_back(i);
    choices *= candidates[i].size();
    if (choices > most_choices) return findings;
  }
  if (open.empty()) return findings;
  // Each choice costs what its two pixels tell.
  const int least_redundancy = 2 + 2 * static_cast<int>(open.size());
  std::vector<MarkFinding> best = findings;
  double least = std::numeric_limits<double>::infinity(), second = least;
  for (std::size_t choice = 0; choice < choices; ++choice) {
    std::vector<MarkFinding> chosen = findings;
    std::size_t rest = choice;
    for (const std::size_t i : open) {
      chosen[i] = candidates[i][rest % candidates[i].size()];
      rest /= candidates[i].size();
    }
    const double misfit = misfit_of(job, cameras, chosen, X_WO_start, least_redundancy);
    if (misfit < least) {
      second = least;
      least = misfit;
      best = std::move(chosen);
    } else {
      second = std::min(second, misfit);
    }
  }
  return std::isfinite(least) && second - least > least_advantage ? best : findings;
}

}  // namespace zeropose
