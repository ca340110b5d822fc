#include "measure/triangulation.h"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <optional>
#include <set>

#include "calib/chance.h"
#include "calib/words.h"
#include "measure/small_cholesky.h"

namespace zeropose {
namespace {

using Eigen::Matrix2d;
using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;

// The distance is uncertain by the reciprocal of this share: a tenth, and the covariance, which is of first
// order, is then true to about a percent.
constexpr double least_parallax_sigmas = 10;
constexpr double false_alarm = 0.001;
constexpr int max_rounds = 50;
// The square of the way to the minimum, in sigmas, from where one more step arrives.
constexpr double near_enough = 1e-10;
// The same as a share of the distance to the cameras, where the sigmas are smaller than rounding.
constexpr double near_enough_share = 1e-11;

// Where a camera sees the point.
struct SightLine {
  Vector3d origin_W_mm;
  Vector3d direction_W;  // unit length
  double sigma_rad;      // of the direction, in its least certain direction
};

Matrix2d covariance_of(const TriangulationProblem& problem, const Observation& observation) {
  return observation.covariance_px2 +
         problem.system_sigma_px * problem.system_sigma_px * Matrix2d::Identity();
}

bool valid(const CalibratedCamera& camera) {
  const CameraModel& model = camera.model;
  return std::isfinite(model.fx_px) && model.fx_px > 0 && std::isfinite(model.fy_px) && model.fy_px > 0 &&
         std::isfinite(model.cx_px) && std::isfinite(model.cy_px) && camera.X_WC.matrix().allFinite();
}

bool valid(const Matrix2d& covariance) {
  return covariance.allFinite() && covariance(0, 0) > 0 && covariance.determinant() > 0 &&
         std::abs(covariance(0, 1) - covariance(1, 0)) <= 1e-9 * covariance.trace();
}

// What is wrong with an observation's numbers, or nothing.
std::string fault_of(const TriangulationProblem& problem, const Observation& observation) {
  if (observation.camera >= problem.cameras.size()) return "names a camera that does not exist";
  if (!observation.u_px.allFinite()) return "has a pixel that is not finite";
  if (!valid(observation.covariance_px2)) return "has a covariance that is not positive definite";
  const CalibratedCamera& camera = problem.cameras[observation.camera];
  if (!valid(camera)) return "comes from a camera whose calibration is not usable";
  if (!ray(camera.model, observation.u_px))
    return "has no ray: camera " + camera.name + "'s lens model does not reach to its pixel";
  return {};
}

std::string fault_of(const TriangulationProblem& problem) {
  if (!std::isfinite(problem.system_sigma_px) || problem.system_sigma_px < 0)
    return "the system's sigma is not a number >= 0";
  for (std::size_t i = 0; i < problem.observations.size(); ++i)
    if (const std::string fault = fault_of(problem, problem.observations[i]); !fault.empty())
      return "observation " + number(i + 1) + " (from 1) " + fault;
  return {};
}

std::vector<SightLine> sight_lines(const TriangulationProblem& problem) {
  std::vector<SightLine> lines;
  for (const Observation& observation : problem.observations) {
    const CalibratedCamera& camera = problem.cameras[observation.camera];
    const Vector3d direction_C = ray(camera.model, observation.u_px)->normalized();
    const Matrix2d C = covariance_of(problem, observation);
    const double largest = C.trace() / 2 + std::hypot((C(0, 0) - C(1, 1)) / 2, C(0, 1));
    lines.push_back({camera.X_WC.translation(), camera.X_WC.linear() * direction_C,
                     std::sqrt(largest) / std::min(camera.model.fx_px, camera.model.fy_px)});
  }
  return lines;
}

struct Parallax {
  double angle_rad = 0, sigma_rad = 0;
  double sigmas() const { return angle_rad / sigma_rad; }
};

// The pair of rays whose angle is the most certain one.
Parallax best_parallax(const std::vector<SightLine>& lines) {
  Parallax best{0, 1};
  for (std::size_t i = 0; i < lines.size(); ++i)
    for (std::size_t j = 0; j < i; ++j) {
      const double sine = lines[i].direction_W.cross(lines[j].direction_W).norm();
      const Parallax pair{std::asin(std::min(1.0, sine)), std::hypot(lines[i].sigma_rad, lines[j].sigma_rad)};
      if (pair.sigmas() > best.sigmas()) best = pair;
    }
  return best;
}

// The point with the least sum of squared distances from the rays, or nothing where they are parallel.
std::optional<Vector3d> nearest_to_all(const std::vector<SightLine>& lines) {
  Vector3d middle = Vector3d::Zero(), g = Vector3d::Zero();
  for (const SightLine& line : lines) middle += line.origin_W_mm / static_cast<double>(lines.size());
  Matrix3d N = Matrix3d::Zero();
  for (const SightLine& line : lines) {
    const Matrix3d across = Matrix3d::Identity() - line.direction_W * line.direction_W.transpose();
    N += across;
    g += across * (line.origin_W_mm - middle);
  }
  const SmallCholesky<3> cholesky(N);
  if (!cholesky.ok()) return std::nullopt;
  return middle + cholesky.solve(g);
}

double gap_mm(const std::vector<SightLine>& lines, const Vector3d& p_W_mm) {
  if (lines.size() == 2) {
    const Vector3d across = lines[0].direction_W.cross(lines[1].direction_W).normalized();
    return std::abs(across.dot(lines[0].origin_W_mm - lines[1].origin_W_mm));
  }
  double sum = 0;
  for (const SightLine& line : lines) sum += line.direction_W.cross(p_W_mm - line.origin_W_mm).squaredNorm();
  return std::sqrt(sum / static_cast<double>(lines.size()));
}

// Normal equations of the whitened deviations by the point's place.
struct PointEquations {
  Matrix3d N = Matrix3d::Zero();
  Vector3d g = Vector3d::Zero();
  double cost = 0;
  std::vector<Vector2d> deviations_px;
};

// Nothing where a camera does not see the point.
std::optional<PointEquations> linearise(const TriangulationProblem& problem, const Vector3d& p_W_mm) {
  PointEquations equations;
  for (const Observation& observation : problem.observations) {
    const CalibratedCamera& camera = problem.cameras[observation.camera];
    const Matrix3d R_CW = camera.X_WC.linear().transpose();
    const auto projection = project_with_jacobian(camera.model, R_CW * (p_W_mm - camera.X_WC.translation()));
    if (!projection) return std::nullopt;
    const Vector2d deviation = observation.u_px - projection->u_px;
    const Eigen::Matrix<double, 2, 3> J = projection->du_dp * R_CW;
    const Matrix2d information = covariance_of(problem, observation).inverse();
    equations.N += J.transpose() * information * J;
    equations.g += J.transpose() * information * deviation;
    equations.cost += deviation.dot(information * deviation);
    equations.deviations_px.push_back(deviation);
  }
  return equations;
}

struct Minimum {
  bool found = false;
  Vector3d p_W_mm = Vector3d::Zero();
  PointEquations equations;
};

// The whole step, or the half, a quarter, ... until the deviations become smaller.
bool go_downhill(const TriangulationProblem& problem, Vector3d step, Minimum& at) {
  for (int halving = 0; halving < 30; ++halving, step /= 2) {
    auto next = linearise(problem, at.p_W_mm + step);
    if (!next || !(next->cost < at.equations.cost)) continue;
    at.p_W_mm += step;
    at.equations = std::move(*next);
    return true;
  }
  return false;
}

// Rounding hides the last decrease of the sum, so the last step is taken unseen.
Minimum minimise(const TriangulationProblem& problem, const Vector3d& start_W_mm) {
  Minimum at;
  auto equations = linearise(problem, start_W_mm);
  if (!equations) return at;
  at.p_W_mm = start_W_mm;
  at.equations = std::move(*equations);
  const Vector3d eye_W_mm = problem.cameras[problem.observations.front().camera].X_WC.translation();
  for (int round = 0; round < max_rounds; ++round) {
    const SmallCholesky<3> cholesky(at.equations.N);
    if (!cholesky.ok()) return at;
    const Vector3d step = cholesky.solve(at.equations.g);
    if (at.equations.g.dot(step) <= near_enough * (1 + at.equations.cost) ||
        step.norm() <= near_enough_share * (at.p_W_mm - eye_W_mm).norm()) {
      auto last = linearise(problem, at.p_W_mm + step);
      if (!last) return at;
      at.p_W_mm += step;
      at.equations = std::move(*last);
      at.found = true;
      return at;
    }
    if (!go_downhill(problem, step, at)) return at;
  }
  return at;
}

// The camera behind which the point lies, or nothing.
const CalibratedCamera* turned_away(const TriangulationProblem& problem, const Vector3d& p_W_mm) {
  for (const Observation& observation : problem.observations) {
    const CalibratedCamera& camera = problem.cameras[observation.camera];
    if (!(camera.X_WC.linear().col(2).dot(p_W_mm - camera.X_WC.translation()) > 0)) return &camera;
  }
  return nullptr;
}

TriangulatedPoint failed(Code code, std::string reason) {
  TriangulatedPoint point;
  point.code = code;
  point.reason = std::move(reason);
  return point;
}

// Codes of deviations that are too large, or ok.
void judge(const TriangulationProblem& problem, const Minimum& minimum, TriangulatedPoint& point) {
  const int redundancy = 2 * static_cast<int>(problem.observations.size()) - 3;
  const double misfit = minimum.equations.cost;
  point.code = Code::ok;
  if (chi_square_tail(misfit, redundancy) >= false_alarm) return;
  const auto& deviations = point.deviations_px;
  const auto worst = std::max_element(deviations.begin(), deviations.end(), [](const auto& a, const auto& b) {
    return a.squaredNorm() < b.squaredNorm();
  });
  const std::size_t index = static_cast<std::size_t>(worst - deviations.begin());
  point.code = Code::deviation_not_attributable;
  point.reason = "the cameras contradict each other: " + number(worst->norm()) + " px in camera " +
                 problem.cameras[problem.observations[index].camera].name + ", rays " +
                 number(point.ray_gap_mm) + " mm apart, where the covariance allows " +
                 number(std::sqrt(misfit / redundancy), 1) + " times less";
}

}  // namespace

TriangulatedPoint triangulate(const TriangulationProblem& problem) {
  if (std::string fault = fault_of(problem); !fault.empty())
    return failed(Code::marks_invalid, std::move(fault));
  std::set<std::size_t> seen_by;
  for (const Observation& observation : problem.observations) seen_by.insert(observation.camera);
  if (seen_by.size() < 2)
    return failed(Code::too_few_cameras, "seen by " + number(seen_by.size()) +
                                             (seen_by.size() == 1 ? " camera" : " cameras") +
                                             ", the place of a point needs 2");
  if (seen_by.size() < problem.observations.size())
    return failed(Code::marks_invalid, "a camera is given twice for the point");
  const std::vector<SightLine> lines = sight_lines(problem);
  const Parallax parallax = best_parallax(lines);
  const auto start = parallax.sigmas() >= least_parallax_sigmas ? nearest_to_all(lines) : std::nullopt;
  if (!start)
    return failed(
        Code::geometry_degenerate,
        "the rays are parallel within their noise: " + number(parallax.angle_rad * degrees_per_radian, 4) +
            " deg with a sigma of " + number(parallax.sigma_rad * degrees_per_radian, 4) + " deg");
  if (const CalibratedCamera* camera = turned_away(problem, *start))
    return failed(Code::not_converged, "the rays meet behind camera " + camera->name +
                                           ": the pixels are not of one point, or the calibration is wrong");
  Minimum minimum = minimise(problem, *start);
  if (!minimum.found)
    return failed(Code::not_converged, "no point was found that all " + number(seen_by.size()) +
                                           " cameras could see at these pixels");
  TriangulatedPoint point;
  point.p_W_mm = minimum.p_W_mm;
  point.covariance_mm2 = SmallCholesky<3>(minimum.equations.N).inverse();
  point.ray_gap_mm = gap_mm(lines, point.p_W_mm);
  point.deviations_px = minimum.equations.deviations_px;
  judge(problem, minimum, point);
  return point;
}

}  // namespace zeropose
