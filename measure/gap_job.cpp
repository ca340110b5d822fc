#include "measure/gap_job.h"

#include <Eigen/QR>
#include <algorithm>
#include <array>
#include <cmath>

#include "calib/words.h"
#include "measure/measurement.h"
#include "measure/picture_checks.h"
#include "measure/sharpness.h"

namespace zeropose {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double least_redundancy = 0.02;  // of the error of a gap that shows in its deviation

// Takes a verdict over; true when it is ok.
bool passes(Measurement& measurement, Verdict verdict) {
  measurement.code = verdict.code;
  measurement.reason = std::move(verdict.reason);
  return measurement.code == Code::ok;
}

Verdict check_pictures(const MeasurementProblem& problem, std::span<const PictureHealth> health) {
  for (const GapView& gap : problem.job.gaps->gaps) {
    if (gap.camera >= problem.cameras.size())
      return {Code::marks_invalid, "gap " + gap.name + " names a camera that does not exist"};
    Verdict verdict = check_picture(problem.images, health, gap.camera, problem.cameras[gap.camera]);
    if (verdict.code != Code::ok) return verdict;
  }
  return {Code::ok, {}};
}

std::vector<GapResult> look_at_gaps(const MeasurementProblem& problem) {
  std::vector<GapResult> results;
  for (const GapView& gap : problem.job.gaps->gaps)
    results.push_back(measure_gap(
        {problem.cameras[gap.camera], gap.plane, gap.search, *image_of(problem.images, gap.camera)}));
  return results;
}

// Beyond some blur the finder sees no edge that it could call blurred.
bool without_a_sharp_edge(const ImageView& image, const GapSearch& search) {
  MarkSearch box;
  const Vector2d across(std::abs(std::cos(search.direction_rad)), std::abs(std::sin(search.direction_rad)));
  box.expected_px = search.centre_px;
  box.half_window_px =
      search.half_across_px * across + search.half_along_px * Vector2d(across.y(), across.x());
  const auto blur_px = sharpest_edge_px(image, window_of(image, box));
  return blur_px && *blur_px > search.max_blur_px;
}

bool spoilt(const MeasurementProblem& problem, const GapView& view, const GapResult& gap, MarkStatus status) {
  if (gap.status != GapStatus::edge_not_found && gap.status != GapStatus::low_contrast) return false;
  if (gap.frame.finding.status == status || gap.pane.finding.status == status) return true;
  return status == MarkStatus::blurred &&
         without_a_sharp_edge(*image_of(problem.images, view.camera), view.search);
}

std::string misses_of(const GapTask& task, std::span<const GapResult> results) {
  std::string misses;
  for (std::size_t i = 0; i < results.size(); ++i)
    if (results[i].status != GapStatus::ok)
      misses += (misses.empty() ? "" : "; ") + task.gaps[i].name + " " +
                std::string(name_of(results[i].status)) + ": " + results[i].reason;
  return misses;
}

// Enough gaps were measured, and if not, whether the pictures are to blame.
Verdict check_count(const MeasurementProblem& problem, std::span<const GapResult> results) {
  const GapTask& task = *problem.job.gaps;
  int count = 0;
  std::array<int, spoilt_by.size()> spoilt_counts{};
  for (std::size_t i = 0; i < results.size(); ++i) {
    if (results[i].status == GapStatus::wrong_problem)
      return {Code::marks_invalid, "gap " + task.gaps[i].name + ": " + results[i].reason};
    if (!(task.gaps[i].weight > 0)) continue;
    count += results[i].status == GapStatus::ok ? 1 : 0;
    for (std::size_t k = 0; k < spoilt_by.size(); ++k)
      spoilt_counts[k] += spoilt(problem, task.gaps[i], results[i], spoilt_by[k].status) ? 1 : 0;
  }
  if (count >= task.min_gaps) return {Code::ok, {}};
  const std::string text = number(count) + " gaps were measured, " + number(task.min_gaps) +
                           " are required (" + misses_of(task, results) + ")";
  const auto most = static_cast<std::size_t>(std::ranges::max_element(spoilt_counts) - spoilt_counts.begin());
  const bool by_picture = spoilt_counts[most] > 0 && count + spoilt_counts[most] >= task.min_gaps;
  return {by_picture ? spoilt_by[most].code : Code::too_few_marks, text};
}

PaneGap in_pane(const GapTask& task, std::size_t index, const GapResult& found) {
  const Pose X_TH = task.X_HT.inverse();
  const GapView& gap = task.gaps[index];
  const Vector3d p_T_mm = X_TH * found.pane.p_H_mm, outward_T = X_TH.linear() * found.outward_H;
  // Rounding must not make a unit vector longer.
  const Vector2d outward = outward_T.head<2>() / std::max(1.0, outward_T.head<2>().norm());
  return {gap.name, p_T_mm.head<2>(), outward, found.gap_mm, found.sigma_mm, gap.weight, gap.wanted_mm};
}

// How uneven the used gaps are: half the range of what deviates from wanted, or the largest of it.
double uneven_mm(const GapTask& task, std::span<const PaneGap> gaps, std::span<const double> gaps_mm,
                 const std::vector<bool>& used) {
  double low = INFINITY, high = -INFINITY;
  for (std::size_t i = 0; i < gaps.size(); ++i) {
    if (!used[i]) continue;
    low = std::min(low, gaps_mm[i] - gaps[i].wanted_mm);
    high = std::max(high, gaps_mm[i] - gaps[i].wanted_mm);
  }
  return task.even ? 0.5 * (high - low) : std::max(high, -low);
}

// By how much a shift and turn change a gap, per mm and rad.
Vector3d change_of(const PaneGap& gap) {
  return {gap.outward_T.x(), gap.outward_T.y(),
          gap.p_T_mm.x() * gap.outward_T.y() - gap.p_T_mm.y() * gap.outward_T.x()};
}

// Where more gaps are asked for than there are unknowns, each must be checked by the others: of a wrong one
// nothing would be noticed else. That is so for the only gap left that tells a shift.
Verdict check_redundancy(const GapTask& task, std::span<const PaneGap> gaps, const std::vector<bool>& used) {
  const Eigen::Index unknowns = task.even ? 4 : 3;
  if (task.min_gaps <= unknowns) return {Code::ok, {}};
  Eigen::MatrixXd J(std::ssize(gaps), unknowns);
  for (std::size_t i = 0; i < gaps.size(); ++i) {
    Eigen::VectorXd row = Eigen::VectorXd::Ones(unknowns);
    row.head<3>() = change_of(gaps[i]);
    row(2) /= 1000;  // rad that are as large as mm
    const double variance = gaps[i].sigma_mm * gaps[i].sigma_mm + task.shape_sigma_mm * task.shape_sigma_mm;
    J.row(static_cast<Eigen::Index>(i)) = (used[i] ? 1 / std::sqrt(variance) : 0) * row.transpose();
  }
  const Eigen::MatrixXd Q =
      Eigen::HouseholderQR<Eigen::MatrixXd>(J).householderQ() * Eigen::MatrixXd::Identity(J.rows(), unknowns);
  for (std::size_t i = 0; i < gaps.size(); ++i) {
    const double redundancy = 1 - Q.row(static_cast<Eigen::Index>(i)).squaredNorm();
    if (used[i] && redundancy < least_redundancy)
      return {Code::hidden_error_too_large, "nothing checks gap " + gaps[i].name +
                                                " without those that are missing: of an error of it " +
                                                number(100 * redundancy, 1) + " % would show, at least " +
                                                number(100 * least_redundancy, 0) + " % are needed"};
  }
  return {Code::ok, {}};
}

// After the evening: whether the robot may do the motion, or better stand where it is.
Verdict check_motion(const GapTask& task, std::span<const PaneGap> gaps, const std::vector<bool>& used,
                     const EveningResult& evening, Measurement& measurement) {
  if (evening.even_already) return {Code::ok, {}};
  const Vector3d motion(evening.x_mm, evening.y_mm, evening.rz_rad);
  double largest_mm = 0;
  std::size_t worst = 0;
  for (std::size_t i = 0; i < gaps.size(); ++i) {
    const Vector3d J = change_of(gaps[i]);
    largest_mm = std::max(largest_mm, used[i] ? std::abs(J.dot(motion)) : 0);
    const double sigma_mm = std::sqrt(J.dot(evening.covariance * J));
    if (sigma_mm > measurement.sigma_mm) worst = i;
    measurement.sigma_mm = std::max(measurement.sigma_mm, sigma_mm);
  }
  if (measurement.sigma_mm > task.max_sigma_mm)
    return {Code::sigma_too_large, "the motion is known to " + number(measurement.sigma_mm, 3) +
                                       " mm (one sigma) at gap " + gaps[worst].name + ", at most " +
                                       number(task.max_sigma_mm, 3) + " mm are allowed"};
  const double left_mm = uneven_mm(task, gaps, evening.predicted_mm, used);
  if (left_mm > task.tolerance_mm && largest_mm <= task.tolerance_mm)
    return {Code::gaps_not_even, "no motion makes the gaps more even than " + number(left_mm, 3) + " mm, " +
                                     number(task.tolerance_mm, 3) + " mm are allowed"};
  return {Code::ok, {}};
}

void count_used(const GapTask& task, Measurement& measurement) {
  std::vector<std::size_t> cameras;
  for (const std::size_t i : measurement.gaps->used) cameras.push_back(task.gaps[i].camera);
  std::ranges::sort(cameras);
  measurement.pose.effective_marks = static_cast<int>(cameras.size());
  measurement.pose.effective_cameras =
      static_cast<int>(std::unique(cameras.begin(), cameras.end()) - cameras.begin());
}

// Those that count, and how many of them.
std::vector<bool> used_of(const GapTask& task, GapMeasurement& found) {
  std::vector<bool> used;
  for (std::size_t i = 0; i < found.measured.size(); ++i) {
    const bool counts = task.gaps[found.measured[i]].weight > 0 &&
                        std::ranges::find(found.evening.removed, i) == found.evening.removed.end();
    used.push_back(counts);
    if (counts) found.used.push_back(found.measured[i]);
  }
  return used;
}

Verdict even(const GapTask& task, Measurement& measurement) {
  GapMeasurement& found = *measurement.gaps;
  std::vector<PaneGap> gaps;
  for (std::size_t i = 0; i < found.gaps.size(); ++i) {
    if (found.gaps[i].status != GapStatus::ok) continue;
    gaps.push_back(in_pane(task, i, found.gaps[i]));
    found.measured.push_back(i);
  }
  found.evening = even_gaps({gaps, task.even, task.shape_sigma_mm, task.tolerance_mm, task.max_x_mm,
                             task.max_y_mm, task.max_rz_rad});
  const std::vector<bool> used = used_of(task, found);
  count_used(task, measurement);
  measurement.largest_deviation_mm = found.evening.worst_mm;
  if (found.evening.code != Code::ok) return {found.evening.code, found.evening.reason};
  if (measurement.pose.effective_marks < task.min_gaps)
    return {Code::too_few_marks, number(measurement.pose.effective_marks) + " gaps agree, " +
                                     number(task.min_gaps) + " are required (wrong is " +
                                     gaps[found.evening.removed.front()].name + ")"};
  Verdict checked = check_redundancy(task, gaps, used);
  if (checked.code != Code::ok) {
    if (const std::string misses = misses_of(task, found.gaps); !misses.empty())
      checked.reason += " (" + misses + ")";
    return checked;
  }
  return check_motion(task, gaps, used, found.evening, measurement);
}

}  // namespace

Measurement measure_gaps(const MeasurementProblem& problem) {
  const GapTask& task = *problem.job.gaps;
  Measurement measurement;
  measurement.health = health_of(problem.images);
  measurement.references.code = Code::ok;
  if (!passes(measurement, check_pictures(problem, measurement.health))) return measurement;
  measurement.gaps.emplace();
  measurement.gaps->gaps = look_at_gaps(problem);
  if (!passes(measurement, check_count(problem, measurement.gaps->gaps))) return measurement;
  if (!passes(measurement, even(task, measurement))) return measurement;
  measurement.X_O0O = measurement.gaps->evening.X_TTn;
  measurement.pose.code = Code::ok;
  measurement.pose.X_WO = measurement.X_O0O;
  return measurement;
}

}  // namespace zeropose
