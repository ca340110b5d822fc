#include "measure/references.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "calib/chance.h"
#include "calib/words.h"
#include "measure/measurement.h"

namespace zeropose {
namespace {

using Eigen::Matrix2d;
using Eigen::Vector2d;

constexpr double moved_chance = 5e-4;       // of a false alarm, per camera and measurement
constexpr double suspicious_chance = 1e-3;  // of the running mean
constexpr int trend_length = 20;            // measurements
// Between the frames of one zero measurement nothing that stands still wanders further.
constexpr double max_wander_px = 0.5;

// The references as the marks of a job whose object is the world.
Job job_of(const References& references) {
  Job job;
  job.name = "reference points";
  job.search_mm = references.search_mm;
  for (const ReferencePoint& point : references.points) job.marks.push_back(point.mark);
  job.views = references.views;
  return job;
}

std::string name_of(const References& references, std::span<const CalibratedCamera> cameras,
                    const View& view) {
  return references.points[view.mark].mark.name + " in " + cameras[view.camera].name;
}

const Observation* zero_of(std::span<const Observation> zero, const View& view) {
  for (const Observation& observation : zero)
    if (observation.camera == view.camera && observation.mark == view.mark) return &observation;
  return nullptr;
}

double squares(const Vector2d& d_px, const Matrix2d& covariance) {
  return d_px.dot(covariance.llt().solve(d_px));
}

// Was there a frame of the camera? A search that makes no sense is none of a missing frame.
bool looked_at(std::span<const View> views, std::span<const MarkFinding> findings, std::size_t camera) {
  for (std::size_t i = 0; i < views.size() && i < findings.size(); ++i)
    if (views[i].camera == camera && findings[i].status != MarkStatus::not_searched) return true;
  return false;
}

// What the check of one camera adds up.
struct Sums {
  double now = 0, trend = 0, displacement = 0;
  int trend_views = 0, beyond_chance = 0;
};

// Takes one displacement into the running mean; its weight in the mean is returned.
double advance(ReferenceTrend& trend, std::size_t view, const Vector2d& d_px) {
  trend.count[view] = std::min(trend.count[view] + 1, trend_length);
  const double share = 1.0 / trend.count[view];
  trend.mean_px[view] += share * (d_px - trend.mean_px[view]);
  return share;
}

void add_view(const ReferenceProblem& problem, std::size_t index, const Observation& zero,
              ReferenceTrend& trend, Sums& sums, CameraCheck& check) {
  const MarkFinding& finding = problem.findings[index];
  const Vector2d d_px = finding.u_px - zero.u_px;
  const double drift = problem.references.sigma_px * problem.references.sigma_px;
  const Matrix2d lasting = zero.covariance_px2 + drift * Matrix2d::Identity();
  // Half of sigma_px: a drift is to be noticed before it is as large as what is allowed for.
  const Matrix2d slow = zero.covariance_px2 + drift / 4 * Matrix2d::Identity();
  const double here = squares(d_px, finding.covariance_px2 + lasting);
  ++check.seen;
  sums.now += here;
  sums.displacement += d_px.squaredNorm();
  sums.beyond_chance += chi_square_tail(here, 2) < moved_chance;
  if (d_px.norm() >= check.farthest_px) {
    check.farthest_px = d_px.norm();
    check.farthest = problem.references.points[problem.references.views[index].mark].mark.name;
  }
  const double share = advance(trend, index, d_px);
  if (trend.count[index] < trend_length) return;
  sums.trend += squares(trend.mean_px[index], share / (2 - share) * finding.covariance_px2 + slow);
  ++sums.trend_views;
}

CameraStand stand_of(const References& references, const CameraCheck& check, const Sums& sums) {
  if (check.seen < std::min(check.expected, 2) || !std::isfinite(sums.now)) return CameraStand::too_few_seen;
  if (check.chance < moved_chance)
    return check.farthest_px > references.tolerance_px ? CameraStand::moved : CameraStand::suspicious;
  if (sums.trend_views > 0 && chi_square_tail(sums.trend, 2 * sums.trend_views) < suspicious_chance)
    return CameraStand::suspicious;
  return CameraStand::ok;
}

std::string moved_words(const CalibratedCamera& camera, const CameraCheck& check, const Sums& sums) {
  std::string words = "the reference points of " + camera.name + " are displaced by " + number(check.rms_px) +
                      " px since the zero measurement (root mean square of " + number(check.seen) + "), " +
                      check.farthest + " by " + number(check.farthest_px) + " px";
  if (sums.beyond_chance == 1 && check.seen >= 3)
    words += "; the others stand: " + check.farthest + " may have been knocked itself";
  return words;
}

std::string unseen_words(const CalibratedCamera& camera, const CameraCheck& check) {
  return camera.name + " sees " + number(check.seen) + " of its " + number(check.expected) +
         " reference points, needed are " + number(std::min(check.expected, 2)) +
         ": covered, dirty, or the camera was turned far away";
}

// The code that a camera gives, and the words for it.
void judge(const ReferenceProblem& problem, const CameraCheck& check, const Sums& sums,
           ReferenceCheck& result) {
  Code code = Code::ok;
  std::string words;
  const CalibratedCamera& camera = problem.cameras[check.camera];
  if (check.stand == CameraStand::moved) code = Code::camera_moved, words = moved_words(camera, check, sums);
  if (check.stand == CameraStand::too_few_seen)
    code = Code::reference_missing, words = unseen_words(camera, check);
  if (check.stand == CameraStand::suspicious && problem.references.suspicious_blocks)
    code = Code::camera_suspicious, words = moved_words(camera, check, sums);
  if (code == Code::ok) return;
  // A camera that was moved outranks one that sees too little.
  if (result.code == Code::ok || code < result.code) result.code = code;
  result.reason += (result.reason.empty() ? "" : "; ") + words;
}

std::vector<MarkFinding> findings_of_view(std::span<const std::vector<MarkFinding>> frames,
                                          std::size_t view) {
  std::vector<MarkFinding> found;
  for (const auto& frame : frames)
    if (view < frame.size() && frame[view].status == MarkStatus::found) found.push_back(frame[view]);
  return found;
}

Observation mean_of(const View& view, const std::vector<MarkFinding>& found) {
  Observation mean{view.camera, view.mark, Vector2d::Zero(), Matrix2d::Zero(), 1};
  const double count = static_cast<double>(found.size());
  for (const MarkFinding& finding : found) {
    mean.u_px += finding.u_px / count;
    mean.covariance_px2 += finding.covariance_px2 / (count * count);
  }
  return mean;
}

}  // namespace

std::string_view name_of(CameraStand stand) {
  switch (stand) {
    case CameraStand::ok:
      return "ok";
    case CameraStand::suspicious:
      return "suspicious";
    case CameraStand::moved:
      return "moved";
    case CameraStand::too_few_seen:
      return "too_few_seen";
    default:
      return "unchecked";
  }
}

std::vector<MarkFinding> find_references(std::span<const CameraImage> images, const References& references,
                                         std::span<const CalibratedCamera> cameras) {
  return find_job_marks(images, job_of(references), cameras, Pose::Identity());
}

ReferenceZero average_references(const References& references, std::span<const CalibratedCamera> cameras,
                                 std::span<const std::vector<MarkFinding>> frames) {
  ReferenceZero zero;
  std::string missing;
  for (std::size_t i = 0; i < references.views.size(); ++i) {
    const View& view = references.views[i];
    const bool has_frames = std::ranges::any_of(
        frames, [&](const auto& findings) { return looked_at(references.views, findings, view.camera); });
    if (!has_frames) continue;
    const auto found = findings_of_view(frames, i);
    if (2 * found.size() <= frames.size()) {
      missing += (missing.empty() ? "" : ", ") + name_of(references, cameras, view);
      continue;
    }
    zero.references.push_back(mean_of(view, found));
    for (const MarkFinding& finding : found) {
      const double wander_px = (finding.u_px - zero.references.back().u_px).norm();
      if (wander_px <= max_wander_px) continue;
      return {Code::deviation_not_attributable,
              "reference point " + name_of(references, cameras, view) + " wandered by " + number(wander_px) +
                  " px between the frames of the zero measurement",
              {}};
    }
  }
  if (!missing.empty())
    return {Code::reference_missing,
            "a zero measurement needs every reference point, missing are " + missing,
            {}};
  zero.code = Code::ok;
  return zero;
}

ReferenceCheck check_references(const ReferenceProblem& problem) {
  const std::vector<View>& views = problem.references.views;
  ReferenceCheck result;
  result.code = Code::ok;
  result.trend = problem.trend;
  result.trend.mean_px.resize(views.size(), Vector2d::Zero());
  result.trend.count.resize(views.size(), 0);
  for (std::size_t camera = 0; camera < problem.cameras.size(); ++camera) {
    if (!looked_at(views, problem.findings, camera)) continue;
    CameraCheck check;
    check.camera = camera;
    Sums sums;
    const ReferenceTrend before = result.trend;
    for (std::size_t i = 0; i < views.size() && i < problem.findings.size(); ++i) {
      const Observation* zero = views[i].camera == camera ? zero_of(problem.zero, views[i]) : nullptr;
      if (zero == nullptr) continue;
      ++check.expected;
      if (problem.findings[i].status == MarkStatus::found)
        add_view(problem, i, *zero, result.trend, sums, check);
    }
    if (check.expected == 0) continue;
    if (check.seen > 0) {
      check.rms_px = std::sqrt(sums.displacement / check.seen);
      check.chance = chi_square_tail(sums.now, 2 * check.seen);
    }
    check.stand = stand_of(problem.references, check, sums);
    // Where a moved camera saw its references says nothing about how it drifts once it is put back.
    if (check.chance < moved_chance || check.stand == CameraStand::too_few_seen) result.trend = before;
    judge(problem, check, sums, result);
    result.cameras.push_back(std::move(check));
  }
  return result;
}

}  // namespace zeropose
