#include "measure/body_camera.h"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>

namespace zeropose {
namespace {

using Eigen::Matrix2d;
using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr int unknowns = 11;  // pose 6, log focal, cx, cy, bend, log aspect
using Delta = Eigen::Matrix<double, unknowns, 1>;
using Beliefs = Eigen::Matrix<double, 5, 1>;
using Normal = Eigen::Matrix<double, unknowns, unknowns>;
constexpr int most_rounds = 40;
constexpr double model_px = 0.2;     // what the rough model leaves: the weight of what was believed before
constexpr double small_gain = 1e-6;  // relative

// The angle of the image's corner, for what a bend means.
double corner_slope(const CameraModel& model) {
  return 0.5 * std::hypot(model.width_px, model.height_px) / model.fx_px;
}

double bend_of(const CameraModel& model) {
  const auto* lens = std::get_if<Division>(&model.distortion);
  return lens == nullptr ? 0 : lens->K * corner_slope(model) * corner_slope(model);
}

CameraModel changed(CameraModel model, const Delta& delta) {
  const double bend = bend_of(model) + delta(9);
  model.fx_px *= std::exp(delta(6));
  model.fy_px *= std::exp(delta(6) + delta(10));
  model.cx_px += delta(7);
  model.cy_px += delta(8);
  if (auto* lens = std::get_if<Division>(&model.distortion))
    lens->K = bend / (corner_slope(model) * corner_slope(model));
  return model;
}

class Fit {
 public:
  Fit(const RoughInternals& before, std::span<const BodyPair> pairs, double scale_px)
      : before_(before), pairs_(pairs), scale2_(scale_px * scale_px) {
    sigmas_ << before.sigma_focal, before.sigma_origin_px, before.sigma_origin_px, before.sigma_bend,
        before.sigma_aspect;
    sigmas_ /= model_px;
  }

  // Infinite where a point has no image.
  double cost(const RoughCamera& at) const {
    double sum = 0;
    for (const BodyPair& pair : pairs_) {
      const auto u_px = project(at.model, at.X_CB * pair.p_B_mm);
      if (!u_px) return std::numeric_limits<double>::infinity();
      sum += scale2_ * std::log1p((pair.u_px - *u_px).squaredNorm() / scale2_);
    }
    return sum + beside(at.model).cwiseQuotient(sigmas_).squaredNorm();
  }

  void equations(const RoughCamera& at, Normal& N, Delta& g) const {
    N.setZero();
    g.setZero();
    for (const BodyPair& pair : pairs_) add(at, pair, N, g);
    const Beliefs off = beside(at.model);
    for (int k = 0; k < off.size(); ++k) {
      const double weight = 1 / (sigmas_(k) * sigmas_(k));
      N(6 + k, 6 + k) += weight;
      g(6 + k) -= weight * off(k);
    }
  }

 private:
  // From what was believed before: log focal, origin, bend, log aspect.
  Beliefs beside(const CameraModel& model) const {
    const double focal = std::log(model.fx_px / before_.model.fx_px);
    return (Beliefs() << focal, model.cx_px - before_.model.cx_px, model.cy_px - before_.model.cy_px,
            bend_of(model) - bend_of(before_.model), std::log(model.fy_px / before_.model.fy_px) - focal)
        .finished();
  }
  void add(const RoughCamera& at, const BodyPair& pair, Normal& N, Delta& g) const {
    const Vector3d turned = at.X_CB.linear() * pair.p_B_mm, p_C = turned + at.X_CB.translation();
    const auto seen = project_with_all_jacobians(at.model, p_C);
    if (!seen) return;
    Eigen::Matrix<double, 2, unknowns> J;
    J.leftCols<3>() = seen->du_dp;
    J.middleCols<3>(3) = -seen->du_dp * cross_matrix(turned);
    J.col(6) = at.model.fx_px * seen->du_di.col(0) + at.model.fy_px * seen->du_di.col(1);
    J.col(10) = at.model.fy_px * seen->du_di.col(1);
    J.middleCols<2>(7) = seen->du_di.middleCols<2>(2);
    J.col(9).setZero();
    if (std::holds_alternative<Division>(at.model.distortion)) {
      // With the bend held, the lens's K falls as the square of the focal length grows.
      const double slope2 = corner_slope(at.model) * corner_slope(at.model);
      J.col(9) = seen->du_di.col(4) / slope2;
      J.col(6) += 2 * bend_of(at.model) * J.col(9);
    }
    const Vector2d r = pair.u_px - seen->u_px;
    const double weight = 1 / (1 + r.squaredNorm() / scale2_);
    N += weight * J.transpose() * J;
    g += weight * J.transpose() * r;
  }

  const RoughInternals& before_;
  std::span<const BodyPair> pairs_;
  double scale2_;
  Beliefs sigmas_;
};

RoughCamera stepped(const RoughCamera& at, const Delta& delta) {
  return {changed(at.model, delta), moved(at.X_CB, delta.head<6>()), 0};
}

}  // namespace

// In the frame whose z axis looks at the place the plane is seen as by a camera far away: the images of its
// axes are theirs without depth, times one scale.
std::array<Pose, 2> poses_of_plane(const CameraModel& model, const Vector3d& p_B_mm, const Matrix3d& axes_B,
                                   const Vector2d& u_px, const Matrix2d& stretch) {
  const Vector3d d = ray(model, u_px)
                         .value_or(Vector3d((u_px.x() - model.cx_px) / model.fx_px,
                                            (u_px.y() - model.cy_px) / model.fy_px, 1));
  Matrix3d R_CD;
  R_CD.col(2) = d.normalized();
  R_CD.col(0) = Vector3d::UnitY().cross(R_CD.col(2)).normalized();
  R_CD.col(1) = R_CD.col(2).cross(R_CD.col(0));
  Eigen::Matrix<double, 2, 3> from_point;
  from_point << 1, 0, -d.x(), 0, 1, -d.y();
  const Matrix2d across = from_point * R_CD.leftCols<2>();
  const Matrix2d B = across.inverse() * Vector2d(1 / model.fx_px, 1 / model.fy_px).asDiagonal() * stretch;
  const Matrix2d S = B.transpose() * B;
  const double mean = 0.5 * S.trace(), spread = std::hypot(0.5 * (S(0, 0) - S(1, 1)), S(0, 1));
  const double scale2 = mean + spread;  // 1 / depth^2
  const Vector2d z(std::sqrt(std::max(0.0, 1 - S(0, 0) / scale2)),
                   std::sqrt(std::max(0.0, 1 - S(1, 1) / scale2)) * (S(0, 1) > 0 ? -1 : 1));
  std::array<Pose, 2> poses;
  for (int k = 0; k < 2; ++k) {
    Matrix3d R_DP;
    R_DP.col(0) << B.col(0) / std::sqrt(scale2), k == 0 ? z.x() : -z.x();
    R_DP.col(1) << B.col(1) / std::sqrt(scale2), k == 0 ? z.y() : -z.y();
    R_DP.col(2) = R_DP.col(0).cross(R_DP.col(1));
    Pose& X_CB = poses[std::size_t(k)] = Pose::Identity();
    X_CB.linear() = nearest_rotation(R_CD * R_DP * axes_B.transpose());
    X_CB.translation() = d / std::sqrt(scale2) - X_CB.linear() * p_B_mm;
  }
  return poses;
}

std::optional<RoughCamera> fit_rough_camera(const RoughInternals& before, const RoughCamera& start,
                                            std::span<const BodyPair> pairs, double scale_px) {
  const Fit fit(before, pairs, scale_px);
  RoughCamera at = start;
  at.cost = fit.cost(at);
  if (!std::isfinite(at.cost)) return std::nullopt;
  double damping = 1e-4;
  for (int round = 0; round < most_rounds; ++round) {
    Normal N;
    Delta g;
    fit.equations(at, N, g);
    N.diagonal() *= 1 + damping;
    const Delta delta = N.ldlt().solve(g);
    if (!delta.allFinite()) return std::nullopt;
    RoughCamera next = stepped(at, delta);
    next.cost = fit.cost(next);
    const double gain = at.cost - next.cost;
    if (!(gain >= 0)) {
      damping = std::max(1e-6, damping * 10);
      if (damping > 1e6) break;
      continue;
    }
    damping *= 0.2;
    at = next;
    if (gain <= small_gain * at.cost) break;
  }
  return at;
}

}  // namespace zeropose
