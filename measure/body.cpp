#include "measure/body.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "calib/words.h"
#include "measure/body_layout.h"
#include "measure/body_numbering.h"
#include "measure/marks.h"

namespace zeropose {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double largest_share = 1.0 / 6;  // of the image's diagonal, that a mark may take
constexpr double most_next = 0.75;         // of the best numbering's discs, that another may explain
constexpr std::size_t least_lead = 4, least_marks = 8;
// A reading beyond these is held against those of the table mirrored or seen from behind.
constexpr double suspicious_px = 0.3, unsuspicious_share = 0.75;
constexpr double clearly_better = 0.5;  // of the rms, that the mirrored table leaves

bool is_clear(const Numberings& found) {
  return found.best.count >= found.next_best + least_lead &&
         double(found.next_best) <= most_next * double(found.best.count);
}

BodyResult refusal(BodyStatus status, std::string reason) {
  BodyResult result;
  result.status = status;
  result.reason = std::move(reason);
  return result;
}

// Empty when all is well.
std::string wrong_with(const BodyProblem& problem) {
  if (problem.marks.size() < least_marks)
    return "a body of " + number(problem.marks.size()) + " marks, at least " + number(least_marks) +
           " are needed";
  for (const BodyMark& mark : problem.marks) {
    if (!mark.p_B_mm.allFinite() || !mark.normal_B.allFinite() || !(mark.radius_mm >= 0))
      return "mark " + mark.name + " has a number that is none";
  }
  if (!(problem.focal_px >= 0)) return "the focal length must be above 0 px";
  if (!(problem.min_diameter_px >= 3)) return "the least diameter must be at least 3 px";
  if (!(problem.min_axis_ratio > 0 && problem.min_axis_ratio <= 1))
    return "the least axis ratio must lie between 0 and 1";
  if (!(problem.min_contrast > 0)) return "the least contrast must be above 0";
  if (!(problem.least_share >= 0 && problem.least_share <= 1))
    return "the least share must lie between 0 and 1";
  return {};
}

std::vector<RoughInternals> guesses_of(const ImageView& image, const BodyProblem& problem) {
  if (problem.camera) return {{*problem.camera, 0.1, 0.002, 10, 0.02}};
  CameraModel model{image.width_px,
                    image.height_px,
                    problem.focal_px,
                    problem.focal_px,
                    0.5 * (image.width_px - 1),
                    0.5 * (image.height_px - 1),
                    Division{}};
  const double sigma_origin_px = 0.05 * image.width_px;
  if (problem.focal_px > 0) return {{model, 0.2, 0.02, sigma_origin_px, 0.05}};
  std::vector<RoughInternals> guesses;
  for (const double widths : {1.2, 2.5, 5.5}) {
    model.fx_px = model.fy_px = widths * image.width_px;
    guesses.push_back({model, 0.5, 0.02, sigma_origin_px, 0.05});
  }
  return guesses;
}

// One polarity: what is round, and its best numbering.
struct Reading {
  bool dark = true;
  std::vector<MarkFinding> findings;
  std::vector<LatticeDisc> discs;
  Numberings found;
};

Reading read(const ImageView& image, const BodyProblem& problem, const BodyLayout& layout, bool dark) {
  MarkSearch search;
  search.bright = !dark;
  search.expected_px = search.half_window_px = 0.5 * Vector2d(image.width_px - 1, image.height_px - 1);
  search.min_diameter_px = problem.min_diameter_px;
  search.max_diameter_px =
      std::max(problem.min_diameter_px + 1, largest_share * std::hypot(image.width_px, image.height_px));
  search.min_axis_ratio = problem.min_axis_ratio;
  search.min_contrast = problem.min_contrast;
  Reading reading;
  reading.dark = dark;
  reading.findings = find_all_marks(image, search).found;
  for (const MarkFinding& finding : reading.findings)
    reading.discs.push_back({finding.u_px, finding.shape_px2});
  reading.found = number_discs(reading.discs, problem.marks, layout, guesses_of(image, problem));
  return reading;
}

// The left-handed table, and its inverse.
Matrix3d swapped_axes() {
  Matrix3d M;
  M << 0, 1, 0, 1, 0, 0, 0, 0, 1;
  return M;
}

std::vector<BodyMark> changed(std::span<const BodyMark> marks, const Matrix3d& M, double normal_sign) {
  std::vector<BodyMark> other(marks.begin(), marks.end());
  for (BodyMark& mark : other) {
    mark.p_B_mm = M * mark.p_B_mm;
    mark.normal_B = normal_sign * M * mark.normal_B;
  }
  return other;
}

// How well another table of the same marks explains the discs.
Numberings numbered_with(const ImageView& image, const BodyProblem& problem, const Reading& reading,
                         const std::vector<BodyMark>& marks) {
  return number_discs(reading.discs, marks, layout_of(marks), guesses_of(image, problem));
}

// The discs fit the mirrored table seen with near and far exchanged: a flat picture of the one looks like a
// flat picture of the other, so only the remaining deviations can tell.
double rms_when_mirrored(const ImageView& image, const BodyProblem& problem, const Reading& reading) {
  const Numbering& best = reading.found.best;
  const Matrix3d M = swapped_axes();
  Vector3d middle_C = Vector3d::Zero();
  std::vector<BodyPair> pairs;
  for (std::size_t mark = 0; mark < best.disc_of.size(); ++mark) {
    if (best.disc_of[mark] == no_disc) continue;
    const Vector3d& p_B = problem.marks[mark].p_B_mm;
    pairs.push_back({M * p_B, reading.discs[best.disc_of[mark]].u_px});
    middle_C += best.camera.X_CB * p_B / double(best.count);
  }
  const Vector3d sight = middle_C.normalized();
  const Matrix3d flip = Matrix3d::Identity() - 2 * sight * sight.transpose();
  double least = std::numeric_limits<double>::infinity();
  for (const RoughInternals& guess : guesses_of(image, problem)) {
    // As large in the image as before.
    const Vector3d middle = middle_C * (guess.model.fx_px / best.camera.model.fx_px);
    RoughCamera start{guess.model, Pose::Identity(), 0};
    start.X_CB.linear() = flip * best.camera.X_CB.linear() * M;
    start.X_CB.translation() = middle + flip * (best.camera.X_CB.translation() - middle_C);
    const auto camera = fit_rough_camera(guess, start, pairs, std::max(1.0, best.rms_px));
    if (!camera) continue;
    double sum = 0;
    for (const BodyPair& pair : pairs)
      sum +=
          (project(camera->model, camera->X_CB * pair.p_B_mm).value_or(Vector2d::Constant(1e6)) - pair.u_px)
              .squaredNorm();
    least = std::min(least, std::sqrt(sum / double(pairs.size())));
  }
  return least;
}

const char* mirrored_advice =
    "the table is mirrored (left-handed: two of its axes exchanged, or one with the wrong sign)";

std::string counts(const Reading& reading) {
  return number(reading.found.best.count) + " of " + number(reading.discs.size()) + " round things";
}

// What else the table could have been meant to be, where that explains clearly more; failed: nothing.
BodyResult wrong_table(const ImageView& image, const BodyProblem& problem, const Reading& reading) {
  const std::size_t best = reading.found.best.count;
  const Numberings mirrored =
      numbered_with(image, problem, reading, changed(problem.marks, swapped_axes(), 1));
  const bool has_normals = std::any_of(problem.marks.begin(), problem.marks.end(),
                                       [](const BodyMark& mark) { return !mark.normal_B.isZero(); });
  Numberings behind;
  if (has_normals)
    behind = numbered_with(image, problem, reading, changed(problem.marks, Matrix3d::Identity(), -1));
  const Numberings& other = behind.best.count >= mirrored.best.count ? behind : mirrored;
  const std::string numbers = number(other.best.count) + " of " + number(reading.discs.size()) +
                              " round things, as it is " + number(best);
  if (!is_clear(other) || other.best.count < std::max(least_marks, best + least_lead)) return {};
  if (&other == &behind)
    return refusal(
        BodyStatus::from_behind,
        "the normals nx ny nz point away from the camera: with the other sign the table explains " + numbers);
  return refusal(BodyStatus::mirrored,
                 std::string(mirrored_advice) + ": mirrored back it explains " + numbers);
}

// Why there is no numbering that counts, or it does not.
BodyResult explained(const ImageView& image, const BodyProblem& problem, const Reading& reading) {
  BodyResult wrong = wrong_table(image, problem, reading);
  if (wrong.status != BodyStatus::failed) return wrong;
  const std::size_t best = reading.found.best.count, next = reading.found.next_best;
  if (best >= least_marks && !is_clear(reading.found))
    return refusal(BodyStatus::ambiguous, "the best numbering explains " + counts(reading) +
                                              ", one with other numbers " + number(next) +
                                              ": more of the body must be seen, at least two of its planes");
  if (best >= least_marks)
    return refusal(BodyStatus::too_few, "found " + number(best) + " of " + number(problem.marks.size()) +
                                            " marks, at least " + number(100 * problem.least_share, 0) +
                                            " % are needed");
  return refusal(BodyStatus::no_numbering, "no numbering explains more than " + number(best) + " of " +
                                               number(reading.discs.size()) + " round things, at least " +
                                               number(least_marks) + " of " + number(problem.marks.size()) +
                                               " marks are needed: is it this body, are the marks at least " +
                                               number(problem.min_diameter_px, 0) +
                                               " px wide, and is the focal length right within 20 %?");
}

BodyPoint point_of(const BodyProblem& problem, const BodyLayout& layout, const Reading& reading,
                   std::size_t mark) {
  const Numbering& best = reading.found.best;
  const MarkFinding& disc = reading.findings[best.disc_of[mark]];
  const Vector3d p_C = best.camera.X_CB * problem.marks[mark].p_B_mm;
  BodyPoint point{
      mark, disc.u_px, disc.covariance_px2, disc.diameter_px, Vector2d::Zero(), layout.normals_B[mark]};
  if ((best.camera.X_CB.linear() * point.normal_B).dot(p_C) > 0) point.normal_B = -point.normal_B;
  point.dev_px = disc.u_px - project(best.camera.model, p_C).value_or(disc.u_px);
  return point;
}

BodyResult accepted(const BodyProblem& problem, const BodyLayout& layout, const Reading& reading) {
  BodyResult result;
  result.status = BodyStatus::found;
  const Numbering& best = reading.found.best;
  for (std::size_t mark = 0; mark < problem.marks.size(); ++mark) {
    if (best.disc_of[mark] == no_disc)
      result.missing.push_back(mark);
    else
      result.points.push_back(point_of(problem, layout, reading, mark));
  }
  if (!result.missing.empty())
    result.reason = "found " + number(best.count) + " of " + number(problem.marks.size()) + " marks";
  return result;
}

BodyResult judged(const ImageView& image, const BodyProblem& problem, const BodyLayout& layout,
                  const Reading& reading) {
  const Numbering& best = reading.found.best;
  const double least = std::max(double(least_marks), problem.least_share * double(problem.marks.size()));
  if (double(best.count) < least || !is_clear(reading.found)) return explained(image, problem, reading);
  if (best.rms_px > suspicious_px || double(best.count) < unsuspicious_share * double(problem.marks.size())) {
    BodyResult wrong = wrong_table(image, problem, reading);
    if (wrong.status != BodyStatus::failed) return wrong;
  }
  const double mirrored_px = rms_when_mirrored(image, problem, reading);
  if (mirrored_px < clearly_better * best.rms_px)
    return refusal(BodyStatus::mirrored, std::string(mirrored_advice) + ": as it is the marks deviate by " +
                                             number(best.rms_px) + " px, mirrored back by " +
                                             number(mirrored_px) + " px (root mean square)");
  return accepted(problem, layout, reading);
}

}  // namespace

std::string_view name_of(BodyStatus status) {
  switch (status) {
    case BodyStatus::failed:
      return "failed";
    case BodyStatus::found:
      return "found";
    case BodyStatus::wrong_problem:
      return "wrong_problem";
    case BodyStatus::empty_image:
      return "empty_image";
    case BodyStatus::no_layout:
      return "no_layout";
    case BodyStatus::no_numbering:
      return "no_numbering";
    case BodyStatus::too_few:
      return "too_few";
    case BodyStatus::ambiguous:
      return "ambiguous";
    case BodyStatus::mirrored:
      return "mirrored";
    case BodyStatus::from_behind:
      return "from_behind";
  }
  return "unknown";
}

BodyResult find_body(const ImageView& image, const BodyProblem& problem) {
  const std::string wrong = wrong_with(problem);
  if (!wrong.empty()) return refusal(BodyStatus::wrong_problem, wrong);
  if (image.data == nullptr || image.width_px < 16 || image.height_px < 16)
    return refusal(BodyStatus::empty_image, "an image of " + number(image.width_px) + " x " +
                                                number(image.height_px) + " px is too small for a body");
  const BodyLayout layout = layout_of(problem.marks);
  std::size_t cells = 0;
  for (const BodyPlane& plane : layout.planes) cells += plane.cells.size();
  if (cells == 0)
    return refusal(BodyStatus::no_layout,
                   "the table of " + number(problem.marks.size()) + " marks has " +
                       number(layout.planes.size()) +
                       " planes of four marks and more, but no four neighbours in rows and columns");
  Reading reading = read(image, problem, layout, true);
  if (reading.found.best.count < problem.marks.size()) {
    Reading bright = read(image, problem, layout, false);
    if (bright.found.best.count > reading.found.best.count) reading = std::move(bright);
  }
  BodyResult result = judged(image, problem, layout, reading);
  result.discs = reading.discs.size();
  result.explained = reading.found.best.count;
  result.next_best = reading.found.next_best;
  result.dark_on_light = reading.dark;
  result.rough_model = reading.found.best.camera.model;
  result.X_CB = reading.found.best.camera.X_CB;
  result.rms_px = reading.found.best.rms_px;
  return result;
}

}  // namespace zeropose
