#include "measure/compensation.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <optional>

#include "calib/words.h"
#include "measure/mark_image.h"
#include "measure/small_cholesky.h"

namespace zeropose {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double enough_px = 1e-4;
constexpr double settled_mm = 1e-5;

// How one camera sees a mark at its present place.
struct Glance {
  Vector2d gap_px = Vector2d::Zero();  // found - projected
  Vector3d p_CQ_mm = Vector3d::Zero();
  Eigen::Matrix<double, 2, 3> by_p_O;  // px per mm
};

class Relaxation {
 public:
  explicit Relaxation(const CompensationProblem& problem)
      : problem_(problem), seen_by_(problem.marks.size()) {
    for (const Observation& observation : problem.observations)
      seen_by_[observation.mark].push_back(&observation);
    shifts_.assign(problem.marks.size(), Vector3d::Zero());
  }

  // The largest change of a shift in this round, mm; nullopt when a mark has no image.
  std::optional<double> round() {
    double largest_mm = 0;
    for (std::size_t mark = 0; mark < seen_by_.size(); ++mark) {
      if (seen_by_[mark].empty()) continue;
      const auto step = seen_by_[mark].size() == 1 ? step_at_constant_depth(mark) : step_of_all(mark);
      if (!step) return std::nullopt;
      shifts_[mark] += *step;
      largest_mm = std::max(largest_mm, step->norm());
    }
    return largest_mm;
  }

  std::optional<double> largest_deviation_px() const {
    double largest = 0;
    for (const Observation& observation : problem_.observations) {
      const auto glance = look(observation);
      if (!glance) return std::nullopt;
      largest = std::max(largest, glance->gap_px.norm());
    }
    return largest;
  }

  const std::vector<Vector3d>& shifts() const { return shifts_; }

 private:
  std::optional<Glance> look(const Observation& observation) const {
    const CalibratedCamera& camera = problem_.cameras[observation.camera];
    const Mark& mark = problem_.marks[observation.mark];
    const Pose X_CO = camera.X_WC.inverse() * problem_.X_WO0;
    Glance glance;
    glance.p_CQ_mm = X_CO * (mark.p_O_mm + shifts_[observation.mark]);
    const auto projection = project_with_jacobian(camera.model, glance.p_CQ_mm);
    if (!projection) return std::nullopt;
    const Vector2d offset = image_offset(camera.model, mark, glance.p_CQ_mm, X_CO.linear() * mark.normal_O,
                                         observation.radius_share);
    glance.gap_px = observation.u_px - projection->u_px - offset;
    glance.by_p_O = projection->du_dp * X_CO.linear();
    return glance;
  }

  std::optional<Vector3d> step_at_constant_depth(std::size_t mark) const {
    const Observation& observation = *seen_by_[mark].front();
    const CalibratedCamera& camera = problem_.cameras[observation.camera];
    const auto glance = look(observation);
    if (!glance) return std::nullopt;
    const auto here = project(camera.model, glance->p_CQ_mm);
    const auto direction = here ? ray(camera.model, *here + problem_.alpha * glance->gap_px) : std::nullopt;
    if (!direction) return std::nullopt;
    const Eigen::Matrix3d R_OC = problem_.X_WO0.linear().transpose() * camera.X_WC.linear();
    return R_OC * (glance->p_CQ_mm.z() * *direction - glance->p_CQ_mm);
  }

  std::optional<Vector3d> step_of_all(std::size_t mark) const {
    Eigen::Matrix3d N = Eigen::Matrix3d::Zero();
    Vector3d g = Vector3d::Zero();
    for (const Observation* observation : seen_by_[mark]) {
      const auto glance = look(*observation);
      if (!glance) return std::nullopt;
      const Eigen::Matrix<double, 3, 2> weighted =
          glance->by_p_O.transpose() * observation->covariance_px2.inverse();
      N += weighted * glance->by_p_O;
      g += weighted * glance->gap_px;
    }
    // Cameras that look along the same line leave the depth open: then the smallest step.
    const SmallCholesky<3> cholesky(N);
    if (cholesky.ok() && condition_of(N, cholesky.inverse()) < 1e9) return problem_.alpha * cholesky.solve(g);
    const Eigen::Matrix3d smallest = 1e-9 * N.trace() * Eigen::Matrix3d::Identity();
    return problem_.alpha * SmallCholesky<3>(N + smallest).solve(g);
  }

  const CompensationProblem& problem_;
  std::vector<std::vector<const Observation*>> seen_by_;
  std::vector<Vector3d> shifts_;
};

bool valid(const CompensationProblem& problem) {
  return problem.alpha > 0 && problem.alpha <= 1 && problem.X_WO0.matrix().allFinite() &&
         std::all_of(problem.observations.begin(), problem.observations.end(),
                     [&problem](const auto& observation) {
                       return observation.camera < problem.cameras.size() &&
                              observation.mark < problem.marks.size() && observation.u_px.allFinite() &&
                              observation.covariance_px2.determinant() > 0;
                     });
}

CompensationResult failed(Code code, std::string reason) {
  CompensationResult result;
  result.code = code;
  result.reason = std::move(reason);
  return result;
}

}  // namespace

CompensationResult compensate(const CompensationProblem& problem) {
  if (!valid(problem))
    return failed(Code::marks_invalid,
                  "the compensation was given observations or a share that cannot be used");
  Relaxation relaxation(problem);
  CompensationResult result;
  bool settled = false;
  while (true) {
    const auto deviation = relaxation.largest_deviation_px();
    if (!deviation) return failed(Code::not_converged, "a mark has no image while the marks are compensated");
    result.largest_deviation_px = *deviation;
    if (*deviation < enough_px || settled) break;
    if (result.rounds == problem.max_rounds)
      return failed(Code::not_converged, "the compensation has not settled after " + number(result.rounds) +
                                             " rounds, " + number(*deviation) + " px are left");
    const auto change = relaxation.round();
    if (!change) return failed(Code::not_converged, "a mark has no image while the marks are compensated");
    settled = *change < settled_mm;
    ++result.rounds;
  }
  result.code = Code::ok;
  result.shifts_O_mm = relaxation.shifts();
  return result;
}

}  // namespace zeropose
