#include "measure/pose_start.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "measure/small_cholesky.h"

namespace zeropose {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using Vector9 = Eigen::Matrix<double, 9, 1>;
using Matrix9 = Eigen::Matrix<double, 9, 9>;
using Matrix39 = Eigen::Matrix<double, 3, 9>;
using Matrix93 = Eigen::Matrix<double, 9, 3>;

// Directions of sight within about 1e-4 rad are parallel.
constexpr double parallel_condition = 1e8;

struct Ray {
  Vector3d p_WC_mm, direction_W;  // unit length
  Vector3d p_MQ_mm;
  Matrix3d across;  // I - d d': the part of a vector that points away from the ray
};

std::vector<Ray> rays_of(const PoseModel& model) {
  std::vector<Ray> rays;
  for (std::size_t i = 0; i < model.size(); ++i) {
    if (!model.active(i)) continue;
    const Pose& X_WC = model.camera(i).X_WC;
    const auto direction_C = ray(model.camera(i).model, model.observation(i).u_px);
    if (!direction_C) continue;
    const Vector3d d = (X_WC.linear() * *direction_C).normalized();
    rays.push_back({X_WC.translation(), d, model.p_MQ_mm(i), Matrix3d::Identity() - d * d.transpose()});
  }
  return rays;
}

// R * v as a matrix times the columns of R one below the other.
Matrix39 product_with(const Vector3d& v) {
  Matrix39 M;
  M << v.x() * Matrix3d::Identity(), v.y() * Matrix3d::Identity(), v.z() * Matrix3d::Identity();
  return M;
}

Vector9 columns(const Matrix3d& R) { return R.reshaped(); }

// The sum of squared distances, mm^2, between marks and rays as a function of the rotation only:
// rho' Q rho + 2 b' rho + k with rho the columns of R_WO. The position that belongs to it is p0 - S rho
// (depth factors and position are linear, so they drop out; after Schweighofer and Pinz 2008).
struct DistanceForm {
  Matrix9 Q = Matrix9::Zero();
  Vector9 b = Vector9::Zero();
  double k = 0;
  Vector3d p0 = Vector3d::Zero();
  Matrix39 S = Matrix39::Zero();

  double cost(const Matrix3d& R) const {
    const Vector9 rho = columns(R);
    return rho.dot(Q * rho) + 2 * b.dot(rho) + k;
  }
  CentredPose pose(const Matrix3d& R) const { return {R, p0 - S * columns(R)}; }
};

std::optional<DistanceForm> distance_form(const std::vector<Ray>& rays) {
  Matrix3d sum = Matrix3d::Zero();
  Vector3d eyes = Vector3d::Zero();
  Matrix39 marks = Matrix39::Zero();
  for (const Ray& ray : rays) {
    sum += ray.across;
    eyes += ray.across * ray.p_WC_mm;
    marks += ray.across * product_with(ray.p_MQ_mm);
  }
  const SmallCholesky<3> cholesky(sum);
  if (rays.size() < 3 || !cholesky.ok()) return std::nullopt;
  const Matrix3d inverse = cholesky.inverse();
  if (!(condition_of(sum, inverse) < parallel_condition)) return std::nullopt;
  DistanceForm form;
  form.p0 = inverse * eyes;
  form.S = inverse * marks;
  for (const Ray& ray : rays) {
    const Matrix39 M = product_with(ray.p_MQ_mm) - form.S;
    const Vector3d rest = form.p0 - ray.p_WC_mm;
    form.Q += M.transpose() * ray.across * M;
    form.b += M.transpose() * ray.across * rest;
    form.k += rest.dot(ray.across * rest);
  }
  return form;
}

// Levenberg-Marquardt on the three angles.
Matrix3d refine_rotation(const DistanceForm& form, Matrix3d R) {
  double cost = form.cost(R), damping = 1e-3;
  for (int round = 0; round < 60; ++round) {
    Matrix93 D;
    for (int column = 0; column < 3; ++column) D.middleRows<3>(3 * column) = -cross_matrix(R.col(column));
    const Vector3d slope = D.transpose() * (form.Q * columns(R) + form.b);
    Matrix3d N = D.transpose() * form.Q * D;
    N.diagonal() *= 1 + damping;
    N.diagonal().array() += 1e-12 * N.trace();
    const SmallCholesky<3> cholesky(N);
    if (!cholesky.ok()) return R;
    const Vector3d phi = -cholesky.solve(slope);
    const Matrix3d next = exp_so3(phi) * R;
    const double next_cost = form.cost(next);
    if (next_cost <= cost) {
      R = next;
      cost = next_cost;
      damping /= 10;
      if (phi.norm() < 1e-7) break;
    } else {
      damping = std::max(10 * damping, 1e-6);
      if (damping > 1e9) break;
    }
  }
  return nearest_rotation(R);
}

// Rotations spread evenly over all (super-Fibonacci spiral, Alexa 2022).
Matrix3d spread_rotation(int index, int count) {
  constexpr double two_pi = 6.28318530717958647692, phi = 1.41421356237309504880,
                   psi = 1.533751168755204288118;
  const double s = index + 0.5, share = s / count;
  const double alpha = two_pi * s / phi, beta = two_pi * s / psi;
  const double r = std::sqrt(share), R = std::sqrt(1 - share);
  return Eigen::Quaterniond(R * std::cos(beta), r * std::sin(alpha), r * std::cos(alpha), R * std::sin(beta))
      .toRotationMatrix();
}

bool in_front(const std::vector<Ray>& rays, const CentredPose& pose) {
  return std::all_of(rays.begin(), rays.end(), [&pose](const Ray& ray) {
    return ray.direction_W.dot(pose.R_WO * ray.p_MQ_mm + pose.p_WM_mm - ray.p_WC_mm) > 0;
  });
}

bool same_rotation(const Matrix3d& A, const Matrix3d& B) { return (A - B).norm() < 0.01; }

struct Candidate {
  double cost = 0;
  Matrix3d R;
};

bool cheaper(const Candidate& a, const Candidate& b) { return a.cost < b.cost; }

std::optional<std::vector<CentredPose>> spatial_starts(const PoseModel& model, std::size_t count) {
  constexpr int grid = 256;
  constexpr std::size_t refined = 48;
  const std::vector<Ray> rays = rays_of(model);
  const auto form = distance_form(rays);
  if (!form) return std::nullopt;
  std::vector<Candidate> candidates;
  for (int i = 0; i < grid; ++i) {
    const Matrix3d R = spread_rotation(i, grid);
    candidates.push_back({form->cost(R), R});
  }
  std::stable_sort(candidates.begin(), candidates.end(), cheaper);
  candidates.resize(refined);
  for (Candidate& candidate : candidates) {
    candidate.R = refine_rotation(*form, candidate.R);
    candidate.cost = form->cost(candidate.R);
  }
  std::stable_sort(candidates.begin(), candidates.end(), cheaper);
  std::vector<CentredPose> starts;
  for (const Candidate& candidate : candidates) {
    const CentredPose pose = form->pose(candidate.R);
    const bool known = std::any_of(starts.begin(), starts.end(), [&candidate](const CentredPose& start) {
      return same_rotation(start.R_WO, candidate.R);
    });
    if (!known && in_front(rays, pose) && starts.size() < count) starts.push_back(pose);
  }
  return starts;
}

// A sheet in its plane: cos, sin and the two shifts are linear in the distances to the rays.
std::vector<CentredPose> planar_start(const PoseModel& model) {
  const Pose& X_WP = model.X_WP();
  Eigen::Matrix4d N = Eigen::Matrix4d::Zero();
  Eigen::Vector4d g = Eigen::Vector4d::Zero();
  for (const Ray& ray : rays_of(model)) {
    const Vector3d p_O = ray.p_MQ_mm + model.centroid_O_mm();
    Eigen::Matrix<double, 3, 4> by_unknowns;
    by_unknowns << p_O.x(), -p_O.y(), 1, 0, p_O.y(), p_O.x(), 0, 1, 0, 0, 0, 0;
    const Eigen::Matrix<double, 3, 4> J = ray.across * X_WP.linear() * by_unknowns;
    const Vector3d rest = ray.across * (ray.p_WC_mm - X_WP * Vector3d(0, 0, p_O.z()));
    N += J.transpose() * J;
    g += J.transpose() * rest;
  }
  N.diagonal().array() += 1e-12 * N.trace();  // what the marks leave open stays near zero
  const SmallCholesky<4> cholesky(N);
  if (!cholesky.ok()) return {};
  const Eigen::Vector4d solution = cholesky.solve(g);
  Pose X_PO = Pose::Identity();
  X_PO.linear() = exp_so3({0, 0, std::atan2(solution(1), solution(0))});
  X_PO.translation() << solution(2), solution(3), 0;
  if (!X_PO.matrix().allFinite()) return {};
  return {model.centred(X_WP * X_PO)};
}

}  // namespace

std::optional<std::vector<CentredPose>> start_poses(const PoseModel& model, std::size_t count) {
  if (model.planar()) return planar_start(model);
  return spatial_starts(model, count);
}

}  // namespace zeropose
