#include "measure/measurement.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>

#include "calib/words.h"
#include "measure/association.h"
#include "measure/gap_job.h"
#include "measure/picture_checks.h"
#include "measure/security.h"
#include "measure/sharpness.h"
#include "measure/wheel_job.h"

namespace zeropose {
namespace {

// A mark's image is this much smaller or larger than expected at most: depth, tilt and the drawing's radius.
constexpr double diameter_tolerance = 0.3;
// A disc is seen this much flatter than its normal says at most.
constexpr double axis_ratio_tolerance = 0.6;
constexpr double thinnest_axis_ratio = 0.05;
// Limits for marks of unknown radius.
constexpr double smallest_diameter_px = 4;
// How much the angle of a corner and its direction differ from what is expected at most.
constexpr double corner_tolerance_rad = 0.35;
// Things in one window that the geometry is asked about; more are no question of geometry.
constexpr std::size_t most_alike = 12;
// How far the zero of a sheet may lie off its plane, mm and rad: rounding.
constexpr double in_plane = 1e-6;

// The directions of a corner's two edges in the image as what to look for.
void look_along_edges(MarkSearch& search, const CalibratedCamera& camera, const Mark& mark,
                      const Pose& X_CO) {
  const auto projection = project_with_jacobian(camera.model, X_CO * mark.p_O_mm);
  if (!projection || mark.edges_O.size() != 2) return;
  const auto seen = [&](const Eigen::Vector3d& edge_O) -> Eigen::Vector2d {
    return (projection->du_dp * (X_CO.linear() * edge_O)).normalized();
  };
  const Eigen::Vector2d first = seen(mark.edges_O[0]), second = seen(mark.edges_O[1]);
  const Eigen::Vector2d middle = first + second;
  search.direction_rad = std::atan2(middle.y(), middle.x());
  search.direction_tolerance_rad = corner_tolerance_rad;
  search.opening_rad = std::acos(std::clamp(first.dot(second), -1.0, 1.0));
  search.opening_tolerance_rad = corner_tolerance_rad;
}

MarkSearch search_for(const CalibratedCamera& camera, const Mark& mark, double search_mm, const Pose& X_WO) {
  MarkSearch search;
  search.kind = mark.kind;
  search.bright = mark.bright;
  for (const double radius_mm : mark.inner_radii_mm)
    search.inner_shares.push_back(radius_mm / mark.radius_mm);
  const Pose X_CO = camera.X_WC.inverse() * X_WO;
  const Eigen::Vector3d p_CQ = X_CO * mark.p_O_mm;
  const auto u_px = project(camera.model, p_CQ);
  if (u_px) search.expected_px = *u_px;
  if (!u_px || !in_image(camera.model, *u_px)) return search;
  const Eigen::Vector2d px_per_mm(camera.model.fx_px / p_CQ.z(), camera.model.fy_px / p_CQ.z());
  search.half_window_px = (mark.radius_mm + search_mm) * px_per_mm;
  const double diameter_px = 2 * mark.radius_mm * px_per_mm.maxCoeff();
  const bool known = mark.radius_mm > 0;
  search.min_diameter_px = known ? (1 - diameter_tolerance) * diameter_px : smallest_diameter_px;
  search.max_diameter_px =
      known ? (1 + diameter_tolerance) * diameter_px : 2 * search.half_window_px.minCoeff();
  if (mark.kind == MarkKind::slot || mark.kind == MarkKind::cross)
    search.min_axis_ratio = thinnest_axis_ratio;
  if (mark.kind == MarkKind::corner) look_along_edges(search, camera, mark, X_CO);
  if (mark.normal_O.isZero() || mark.kind == MarkKind::ball) return search;
  const bool flat = mark.kind == MarkKind::disc || mark.kind == MarkKind::ring;
  const double facing = std::abs((X_CO.linear() * mark.normal_O).normalized().dot(p_CQ.normalized()));
  search.min_axis_ratio =
      flat ? axis_ratio_tolerance * facing : std::min(search.min_axis_ratio, axis_ratio_tolerance * facing);
  return search;
}

// O0 in the plane of a sheet as x, y and rz alone; what is left of the others is rounding.
Pose flattened(const Pose& X_PO) {
  const SixNumbers six = to_six_numbers(X_PO);
  return from_six_numbers({six.x_mm, six.y_mm, 0, 0, 0, six.rz_deg});
}

bool lies_in(const Pose& X_WP, const Pose& X_WO) {
  const Pose X_PO = X_WP.inverse() * X_WO;
  return difference(flattened(X_PO), X_PO).norm() < in_plane;
}

Verdict check_zero(const Job& job, const Zero& zero) {
  if (job.wheel ? !(zero.profile_radius_mm > 0) : zero.compensation_O_mm.empty())
    return {Code::zero_missing, "no zero measurement was made for job " + job.name};
  if (zero.compensation_O_mm.size() != job.marks.size())
    return {Code::zero_outdated, "the zero measurement knows " + number(zero.compensation_O_mm.size()) +
                                     " marks, job " + job.name + " has " + number(job.marks.size())};
  const Eigen::Matrix3d R = zero.X_WO0.linear();
  const bool rotation =
      (R.transpose() * R - Eigen::Matrix3d::Identity()).norm() < 1e-6 && R.determinant() > 0;
  const bool finite = zero.X_WO0.matrix().allFinite() && rotation &&
                      std::all_of(zero.compensation_O_mm.begin(), zero.compensation_O_mm.end(),
                                  [](const auto& shift) { return shift.allFinite(); });
  if (!finite)
    return {Code::zero_outdated, "the zero measurement of job " + job.name + " holds numbers that are none"};
  if (job.X_WP_planar && !lies_in(*job.X_WP_planar, zero.X_WO0))
    return {Code::zero_outdated,
            "the zero measurement of job " + job.name + " does not lie in the plane of the sheet"};
  return {Code::ok, {}};
}

Verdict check_images(std::span<const CameraImage> images, std::span<const PictureHealth> health,
                     const Job& job, std::span<const CalibratedCamera> cameras) {
  std::vector<bool> checked(cameras.size());
  for (const std::size_t camera : cameras_of(job)) {
    if (camera >= cameras.size())
      return {Code::marks_invalid, "job " + job.name + " names a camera that does not exist"};
    if (checked[camera]) continue;
    checked[camera] = true;
    Verdict verdict = check_picture(images, health, camera, cameras[camera]);
    if (verdict.code != Code::ok) return verdict;
  }
  for (const View& view : job.views)
    if (view.mark >= job.marks.size())
      return {Code::marks_invalid, "job " + job.name + " names a mark that does not exist"};
  return {Code::ok, {}};
}

std::vector<View> found_views(const Job& job, std::span<const MarkFinding> findings) {
  std::vector<View> found;
  for (std::size_t i = 0; i < job.views.size(); ++i)
    if (findings[i].status == MarkStatus::found) found.push_back(job.views[i]);
  return found;
}

// Why the others were not, in the words of the finder.
std::string misses_of(const Job& job, std::span<const MarkFinding> findings,
                      std::span<const MarkSearch> searches) {
  std::string misses;
  for (std::size_t i = 0; i < job.views.size(); ++i) {
    if (findings[i].status == MarkStatus::found) continue;
    misses += (misses.empty() ? "" : "; ") + job.marks[job.views[i].mark].name + " " +
              std::string(name_of(findings[i].status)) + ": " + reason_text(findings[i], searches[i]);
  }
  return misses;
}

// The findings, with blurred for what was not found in a window without a sharp edge: beyond some blur the
// finder sees no mark that it could call so.
std::vector<MarkFinding> with_blur(std::vector<MarkFinding> findings, std::span<const CameraImage> images,
                                   const Job& job, std::span<const MarkSearch> searches) {
  for (std::size_t i = 0; i < findings.size(); ++i) {
    MarkFinding& finding = findings[i];
    const ImageView* image = image_of(images, job.views[i].camera);
    if (finding.status == MarkStatus::found || finding.status == MarkStatus::blurred || image == nullptr)
      continue;
    const auto blur_px = sharpest_edge_px(*image, window_of(*image, searches[i]));
    if (!blur_px || !(*blur_px > searches[i].max_blur_px)) continue;
    finding.status = MarkStatus::blurred;
    finding.blur_px = *blur_px;
    finding.u_px = searches[i].expected_px;
  }
  return findings;
}

// The verdict on the pictures where the requirements fail only because of marks that pictures spoil; else
// nothing. Names the view that is spoilt most; of two reasons the one that spoils more views.
std::optional<Verdict> spoilt_pictures(const Job& job, std::span<const CalibratedCamera> cameras,
                                       std::span<const MarkFinding> findings,
                                       std::span<const MarkSearch> searches) {
  std::vector<View> views;
  std::array<std::size_t, spoilt_by.size()> counts{}, worst{};
  for (std::size_t i = 0; i < job.views.size(); ++i) {
    if (findings[i].status == MarkStatus::found) views.push_back(job.views[i]);
    for (std::size_t k = 0; k < spoilt_by.size(); ++k) {
      if (findings[i].status != spoilt_by[k].status) continue;
      views.push_back(job.views[i]);
      if (counts[k]++ == 0 || findings[i].blur_px > findings[worst[k]].blur_px) worst[k] = i;
    }
  }
  const auto most = static_cast<std::size_t>(std::max_element(counts.begin(), counts.end()) - counts.begin());
  if (counts[most] == 0 || check_marks(job, cameras, views).code != Code::ok) return std::nullopt;
  const std::size_t i = worst[most];
  return Verdict{spoilt_by[most].code, cameras[job.views[i].camera].name + ", mark " +
                                           job.marks[job.views[i].mark].name + ": " +
                                           reason_text(findings[i], searches[i])};
}

std::vector<View> effective_views(const Measurement& measurement) {
  std::vector<View> used;
  for (std::size_t i = 0; i < measurement.observations.size(); ++i)
    if (measurement.pose.deviations[i].used)
      used.push_back({measurement.observations[i].camera, measurement.observations[i].mark});
  return used;
}

// Takes a verdict over; true when it is ok.
bool passes(Measurement& measurement, Verdict verdict) {
  measurement.code = verdict.code;
  measurement.reason = std::move(verdict.reason);
  return measurement.code == Code::ok;
}

// M6.7.
void look_at_references(Measurement& measurement, const MeasurementProblem& problem) {
  static const ReferenceTrend none;
  measurement.references.code = Code::ok;
  if (problem.references == nullptr) return;
  const References& references = *problem.references;
  measurement.reference_findings = find_references(problem.images, references, problem.cameras);
  measurement.references =
      check_references({references, problem.cameras, problem.zero.references, measurement.reference_findings,
                        problem.reference_trend != nullptr ? *problem.reference_trend : none});
}

// References that are not seen may have the same cause as marks that are not, and those say more about it.
bool cameras_stand(Measurement& measurement, bool marks_are_found) {
  const bool later = measurement.references.code == Code::reference_missing && !marks_are_found;
  return later || passes(measurement, {measurement.references.code, measurement.references.reason});
}

bool find_all(Measurement& measurement, std::span<const CameraImage> images, const Job& job,
              std::span<const CalibratedCamera> cameras, const Pose& X_WO_expected) {
  measurement.findings = find_job_marks(images, job, cameras, X_WO_expected);
  measurement.observations = observations_of(measurement.findings, job);
  Verdict verdict = check_marks(job, cameras, found_views(job, measurement.findings));
  if (verdict.code != Code::ok) {
    const auto searches = job_searches(job, cameras, X_WO_expected);
    const auto seen = with_blur(measurement.findings, images, job, searches);
    if (auto spoilt = spoilt_pictures(job, cameras, seen, searches)) verdict = std::move(*spoilt);
    const std::string misses = misses_of(job, measurement.findings, searches);
    if (!misses.empty()) verdict.reason += " (" + misses + ")";
  }
  return passes(measurement, std::move(verdict));
}

bool estimate_all(Measurement& measurement, const Job& job, std::span<const CalibratedCamera> cameras,
                  const Pose& X_WO_start) {
  PoseProblem problem;
  problem.cameras = cameras;
  problem.marks = job.marks;
  problem.observations = measurement.observations;
  problem.X_WO_start = X_WO_start;
  problem.X_WP_planar = job.X_WP_planar;
  problem.system_sigma_px = job.system_sigma_px;
  measurement.pose = estimate_pose(problem);
  for (const Deviation& deviation : measurement.pose.deviations)
    if (deviation.used)
      measurement.largest_deviation_mm = std::max(measurement.largest_deviation_mm, deviation.dev_mm.norm());
  if (!passes(measurement, {measurement.pose.code, measurement.pose.reason}) ||
      !passes(measurement, check_marks(job, cameras, effective_views(measurement))))
    return false;
  const Reliability reliability = reliability_of(job, problem, measurement.pose);
  measurement.hidden_mm = reliability.hidden_mm;
  return passes(measurement, check_power(job, problem, reliability));
}

// M6.5 and M6.6.
void check_result(Measurement& measurement, const Job& job, const std::optional<Pose>& X_O0O_last) {
  const Pose& X_O0O = measurement.X_O0O;
  if (!passes(measurement, check_limits(job.requirements, X_O0O))) return;
  if (!passes(measurement, check_displacement(job, X_O0O))) return;
  if (X_O0O_last) passes(measurement, check_step(job, *X_O0O_last, X_O0O));
}

}  // namespace

std::vector<MarkSearch> job_searches(const Job& job, std::span<const CalibratedCamera> cameras,
                                     const Pose& X_WO_expected) {
  std::vector<MarkSearch> searches;
  for (const View& view : job.views) {
    const bool known = view.camera < cameras.size() && view.mark < job.marks.size();
    searches.push_back(
        known ? search_for(cameras[view.camera], job.marks[view.mark], job.search_mm, X_WO_expected)
              : MarkSearch{});
  }
  return searches;
}

std::vector<MarkFinding> find_job_marks(std::span<const CameraImage> images, const Job& job,
                                        std::span<const CalibratedCamera> cameras,
                                        const Pose& X_WO_expected) {
  const std::vector<MarkSearch> all = job_searches(job, cameras, X_WO_expected);
  std::vector<MarkFinding> findings(job.views.size());
  std::vector<std::vector<MarkFinding>> candidates(job.views.size());
  for (const CameraImage& image : images) {
    std::vector<MarkSearch> searches;
    std::vector<std::size_t> views;
    for (std::size_t i = 0; i < job.views.size(); ++i) {
      if (job.views[i].camera != image.camera) continue;
      findings[i].status = MarkStatus::outside_image;
      if (!(all[i].half_window_px.minCoeff() > 0)) continue;
      searches.push_back(all[i]);
      views.push_back(i);
    }
    const auto found = find_marks(image.image, searches);
    for (std::size_t k = 0; k < views.size(); ++k) {
      findings[views[k]] = found[k];
      if (found[k].status != MarkStatus::ambiguous) continue;
      AllMarks all_alike = find_all_marks(image.image, searches[k], most_alike);
      if (!all_alike.crowded) candidates[views[k]] = std::move(all_alike.found);
    }
  }
  return decided_by_geometry(job, cameras, std::move(findings), candidates, X_WO_expected);
}

std::vector<Observation> observations_of(std::span<const MarkFinding> findings, const Job& job) {
  std::vector<Observation> observations;
  for (std::size_t i = 0; i < findings.size() && i < job.views.size(); ++i)
    if (findings[i].status == MarkStatus::found)
      observations.push_back({job.views[i].camera, job.views[i].mark, findings[i].u_px,
                              findings[i].covariance_px2, findings[i].radius_share});
  return observations;
}

std::optional<double> mark_blur_px(std::span<const MarkFinding> findings, const Job& job,
                                   std::size_t camera) {
  double sum = 0;
  int count = 0;
  for (std::size_t i = 0; i < findings.size() && i < job.views.size(); ++i) {
    if (job.views[i].camera != camera || findings[i].status != MarkStatus::found) continue;
    sum += findings[i].blur_px;
    ++count;
  }
  return count > 0 ? std::optional(sum / count) : std::nullopt;
}

Measurement measure(const MeasurementProblem& problem) {
  const auto& [images, job, cameras, zero, X_O0O_last, references, trend] = problem;
  if (job.gaps) return measure_gaps(problem);
  Measurement measurement;
  measurement.health = health_of(images);
  if (!passes(measurement, check_zero(job, zero))) return measurement;
  if (!passes(measurement, check_images(images, measurement.health, job, cameras))) return measurement;
  look_at_references(measurement, problem);
  if (!cameras_stand(measurement, false)) return measurement;
  if (job.wheel) {
    measure_wheel_of(measurement, problem);
    if (measurement.code == Code::ok) cameras_stand(measurement, true);
    return measurement;
  }
  const Job now = compensated(job, zero);
  if (!find_all(measurement, images, now, cameras, zero.X_WO0)) return measurement;
  if (!cameras_stand(measurement, true)) return measurement;
  if (!estimate_all(measurement, now, cameras, zero.X_WO0)) return measurement;
  measurement.sigma_mm = worst_sigma_mm(now, measurement.pose);
  if (!passes(measurement, check_sigma(now, measurement.pose))) return measurement;
  measurement.X_O0O = zero.X_WO0.inverse() * measurement.pose.X_WO;
  if (now.X_WP_planar) measurement.X_O0O = flattened(measurement.X_O0O);
  check_result(measurement, now, X_O0O_last);
  return measurement;
}

}  // namespace zeropose
