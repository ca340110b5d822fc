#include "measure/proposal.h"

#include <algorithm>
#include <map>
#include <string>

namespace zeropose {
namespace {

constexpr int least_points = 3, least_groups = 2;

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
    if (point.taught_px && proposal.method != RecalibrationMethod::arbitrary_points) continue;
    if (point.group.empty() && proposal.method == RecalibrationMethod::groups) continue;
    const auto zero = std::ranges::find_if(problem.zero.references, [&](const Observation& each) {
      return each.camera == view.camera && each.mark == view.mark;
    });
    if (zero != problem.zero.references.end()) points.push_back(recalibration_point(references, *zero, now));
  }
  return points;
}

std::optional<Pose> change_of(RecalibrationProblem knocked, const RecalibrationResult& result) {
  if (result.code != Code::ok) return std::nullopt;
  if (knocked.method != RecalibrationMethod::known_points) return result.X_CoCn;
  std::vector<RecalibrationPoint> before(knocked.points.begin(), knocked.points.end());
  for (RecalibrationPoint& point : before)
    point.new_px = point.old_px, point.new_covariance_px2 = point.old_covariance_px2;
  knocked.points = before;
  const RecalibrationResult old = recalibrate(knocked);
  if (old.code != Code::ok) return std::nullopt;
  return Pose(old.X_WCn.inverse() * result.X_WCn);
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
  knocked.sigma_px = 1;
  proposal.result = recalibrate(knocked);
  proposal.X_CoCn = change_of(knocked, proposal.result);
  return proposal;
}

}  // namespace

RecalibrationMethod suited_method(const References& references, std::size_t camera) {
  std::map<std::string, int> groups;
  int known = 0;
  for (const View& view : references.views) {
    const ReferencePoint& point = references.points[view.mark];
    if (view.camera != camera || point.taught_px) continue;
    ++known;
    if (!point.group.empty()) ++groups[point.group];
  }
  const auto whole =
      std::ranges::count_if(groups, [](const auto& group) { return group.second >= least_points; });
  if (whole >= least_groups) return RecalibrationMethod::groups;
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
