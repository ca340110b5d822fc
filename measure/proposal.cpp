#include "measure/proposal.h"

#include <algorithm>
#include <map>
#include <string>

namespace zeropose {
namespace {

constexpr std::size_t least_points = 3, least_groups = 2;

RecalibrationPoint recalibration_point(const References& references, const Observation& zero,
                                       const MarkFinding& now) {
  const ReferencePoint& point = references.points[zero.mark];
  const double drift_px2 = references.sigma_px * references.sigma_px;
  return {point.mark.name,
          point.group,
          point.mark.p_O_mm,
          zero.u_px,
          now.u_px,
          zero.covariance_px2,
          now.covariance_px2 + drift_px2 * Eigen::Matrix2d::Identity()};
}

std::vector<RecalibrationPoint> points_of(const MeasurementProblem& problem, const Measurement& measurement,
                                          const CameraProposal& proposal) {
  const References& references = *problem.references;
  std::vector<RecalibrationPoint> points;
  for (std::size_t i = 0; i < references.views.size(); ++i) {
    const View& view = references.views[i];
    const MarkFinding& now = measurement.reference_findings[i];
    if (view.camera != proposal.camera || now.status != MarkStatus::found) continue;
    const ReferencePoint& point = references.points[view.mark];
    if (!counts_for(proposal.method, point)) continue;
    const auto zero = std::ranges::find_if(problem.zero.references, [&](const Observation& each) {
      return each.camera == view.camera && each.mark == view.mark;
    });
    if (zero != problem.zero.references.end()) points.push_back(recalibration_point(references, *zero, now));
  }
  return points;
}

// The old pixels by the same points and with the same weights as the new ones, so that what is wrong with
// them is the same in both.
RecalibrationResult pose_before(RecalibrationProblem knocked, const RecalibrationResult& now) {
  std::vector<RecalibrationPoint> before;
  for (std::size_t i = 0; i < knocked.points.size(); ++i) {
    if (std::ranges::find(now.removed, i) != now.removed.end()) continue;
    before.push_back(knocked.points[i]);
    before.back().new_px = before.back().old_px;
  }
  knocked.points = before;
  return recalibrate(knocked);
}

void find_change(const RecalibrationProblem& knocked, CameraProposal& proposal) {
  const RecalibrationResult& now = proposal.result;
  proposal.reason = now.reason;
  if (now.code != Code::ok) return;
  if (knocked.method != RecalibrationMethod::known_points) {
    proposal.X_CoCn = now.X_CoCn;
    return;
  }
  const RecalibrationResult before = pose_before(knocked, now);
  if (before.code == Code::ok)
    proposal.X_CoCn = before.X_WCn.inverse() * now.X_WCn;
  else
    proposal.reason = "the pixels of the zero measurement give no pose: " + before.reason;
}

CameraProposal proposal_for(const MeasurementProblem& problem, const Measurement& measurement,
                            std::size_t camera) {
  CameraProposal proposal;
  proposal.camera = camera;
  proposal.method = suited_method(*problem.references, camera);
  proposal.points = points_of(problem, measurement, proposal);
  RecalibrationProblem knocked;
  knocked.method = proposal.method;
  knocked.model = problem.cameras[camera].model;
  knocked.X_WCo = problem.cameras[camera].X_WC;
  knocked.points = proposal.points;
  // Coordinates err by more than the pixels; of more points than it takes the residuals tell.
  const bool known = proposal.method == RecalibrationMethod::known_points;
  knocked.sigma_px = known && proposal.points.size() > least_points ? 0 : 1;
  proposal.result = recalibrate(knocked);
  find_change(knocked, proposal);
  return proposal;
}

}  // namespace

bool counts_for(RecalibrationMethod method, const ReferencePoint& point) {
  if (point.taught_px) return method == RecalibrationMethod::arbitrary_points;
  return method != RecalibrationMethod::groups || !point.group.empty();
}

RecalibrationMethod suited_method(const References& references, std::size_t camera) {
  std::map<std::string, std::size_t> groups;
  std::size_t known = 0;
  for (const View& view : references.views) {
    const ReferencePoint& point = references.points[view.mark];
    if (view.camera != camera || point.taught_px) continue;
    ++known;
    if (!point.group.empty()) ++groups[point.group];
  }
  const std::ptrdiff_t whole =
      std::ranges::count_if(groups, [](const auto& group) { return group.second >= least_points; });
  if (whole >= static_cast<std::ptrdiff_t>(least_groups)) return RecalibrationMethod::groups;
  return known >= least_points ? RecalibrationMethod::known_points : RecalibrationMethod::arbitrary_points;
}

Proposal propose(const MeasurementProblem& problem, const Measurement& measurement) {
  Proposal proposal;
  if (problem.references == nullptr) return proposal;
  for (const CameraCheck& check : measurement.references.cameras)
    if (check.stand == CameraStand::moved)
      proposal.cameras.push_back(proposal_for(problem, measurement, check.camera));
  if (proposal.cameras.empty()) return proposal;
  MeasurementProblem unchecked = problem;
  unchecked.references = nullptr;
  proposal.believed = measure(unchecked);
  std::vector<CalibratedCamera> cameras(problem.cameras.begin(), problem.cameras.end());
  for (const CameraProposal& camera : proposal.cameras) {
    if (!camera.X_CoCn) return proposal;
    cameras[camera.camera].X_WC = cameras[camera.camera].X_WC * *camera.X_CoCn;
  }
  unchecked.cameras = cameras;
  proposal.proposed = measure(unchecked);
  return proposal;
}

}  // namespace zeropose
