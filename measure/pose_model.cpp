#include "measure/pose_model.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "measure/mark_image.h"

namespace zeropose {

using Eigen::Matrix2d;
using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;
using Matrix23 = Eigen::Matrix<double, 2, 3>;

CentredPose moved(const CentredPose& pose, const Vector6& delta) {
  return {exp_so3(delta.tail<3>()) * pose.R_WO, pose.p_WM_mm + delta.head<3>()};
}

namespace {

// W with W' W = P.
Matrix2d whitening_of(const Matrix2d& P) {
  Matrix2d W = Matrix2d::Zero();
  W(0, 0) = std::sqrt(P(0, 0));
  W(0, 1) = P(0, 1) / W(0, 0);
  W(1, 1) = std::sqrt(std::max(0.0, P(1, 1) - W(0, 1) * W(0, 1)));
  return W;
}

void whiten(Sight& sight) {
  const Matrix23 WA = sight.whitening * sight.A;
  sight.Wr.noalias() = sight.whitening * sight.r;
  sight.WJ.topRows<3>() = WA.transpose();
  sight.WJ.col(0).tail<3>() = sight.q.cross(WA.row(0).transpose());
  sight.WJ.col(1).tail<3>() = sight.q.cross(WA.row(1).transpose());
}

}  // namespace

Eigen::Matrix<double, 2, 6> Sight::J() const {
  Eigen::Matrix<double, 2, 6> J;
  J << A, -A * cross_matrix(q);
  return J;
}

PoseModel::PoseModel(const PoseProblem& problem)
    : residual_(problem.residual),
      system_variance_px2_(problem.system_sigma_px * problem.system_sigma_px),
      planar_(problem.X_WP_planar.has_value()) {
  if (planar_) {
    X_WP_ = *problem.X_WP_planar;
    planar_basis_.topLeftCorner<3, 2>() = X_WP_.linear().leftCols<2>();
    planar_basis_.bottomRightCorner<3, 1>() = X_WP_.linear().col(2);
  }
  sights_.reserve(problem.observations.size());
  double count = 0, squares = 0;
  for (const Observation& observation : problem.observations) {
    const CalibratedCamera& camera = problem.cameras[observation.camera];
    const Mark& mark = problem.marks[observation.mark];
    Sight& sight = sights_.emplace_back();
    sight.camera = &camera.model;
    sight.mark = &mark;
    sight.camera_index = observation.camera;
    sight.mark_index = observation.mark;
    sight.R_CW = camera.X_WC.linear().transpose();
    sight.p_WC_mm = camera.X_WC.translation();
    sight.u_px = observation.u_px;
    sight.covariance_px2 = observation.covariance_px2;
    Matrix2d information = Matrix2d::Identity();
    if (residual_ == Residual::reprojection) information = observation.covariance_px2.inverse();
    sight.information = mark.weight * mark.weight * information;
    sight.whitening = (mark.weight > 0 ? mark.weight : 1) * whitening_of(information);
    sight.radius_share = observation.radius_share;
    sight.has_offset = has_image_offset(mark);
    sight.active = mark.weight > 0;
    if (!sight.active) continue;
    ++count;
    centroid_O_mm_ += mark.p_O_mm;
  }
  if (count > 0) centroid_O_mm_ /= count;
  for (Sight& sight : sights_) {
    sight.p_MQ_mm = sight.mark->p_O_mm - centroid_O_mm_;
    if (sight.active) squares += sight.p_MQ_mm.squaredNorm();
  }
  if (squares > 0) extent_mm_ = std::sqrt(squares / count);
}

int PoseModel::active_count() const {
  return static_cast<int>(
      std::count_if(sights_.begin(), sights_.end(), [](const Sight& sight) { return sight.active; }));
}

CentredPose PoseModel::centred(const Pose& X_WO) const {
  if (!planar_) return {X_WO.linear(), X_WO * centroid_O_mm_};
  const Pose X_PO = X_WP_.inverse() * X_WO;
  const double angle =
      std::atan2(X_PO.linear()(1, 0) - X_PO.linear()(0, 1), X_PO.linear()(0, 0) + X_PO.linear()(1, 1));
  Pose X_PO_flat = Pose::Identity();
  X_PO_flat.linear() = exp_so3({0, 0, angle});
  X_PO_flat.translation() << X_PO.translation().head<2>(), 0;
  const Pose X_WO_flat = X_WP_ * X_PO_flat;
  return {X_WO_flat.linear(), X_WO_flat * centroid_O_mm_};
}

Pose PoseModel::pose(const CentredPose& pose) const {
  Pose X_WO = Pose::Identity();
  X_WO.linear() = pose.R_WO;
  X_WO.translation() = pose.p_WM_mm - pose.R_WO * centroid_O_mm_;
  return X_WO;
}

void PoseModel::refresh_offsets(const CentredPose& pose) {
  for (Sight& sight : sights_) {
    if (!sight.has_offset) continue;
    const Vector3d p_C = sight.R_CW * (pose.R_WO * sight.p_MQ_mm + pose.p_WM_mm - sight.p_WC_mm);
    const Vector3d normal_C = sight.R_CW * (pose.R_WO * sight.mark->normal_O);
    sight.offset_px = image_offset(*sight.camera, *sight.mark, p_C, normal_C, sight.radius_share);
  }
}

bool PoseModel::linearise(const CentredPose& pose, Sight& sight) const {
  sight.q = pose.R_WO * sight.p_MQ_mm;
  const Vector3d p_C = sight.R_CW * (sight.q + pose.p_WM_mm - sight.p_WC_mm);
  sight.depth_mm = p_C.z();
  const auto projection = project_with_jacobian(*sight.camera, p_C);
  if (!projection) return false;
  sight.dev_px = sight.u_px - projection->u_px - sight.offset_px;
  if (residual_ == Residual::algebraic) {
    if (!linearise_algebraic(p_C, sight)) return false;
  } else {
    sight.r = sight.dev_px;
    sight.A.noalias() = projection->du_dp * sight.R_CW;
  }
  whiten(sight);
  return true;
}

// (zc x - xc, zc y - yc) with the found direction (x, y): the source's residual, in mm.
bool PoseModel::linearise_algebraic(const Vector3d& p_C_mm, Sight& sight) const {
  const auto direction = ray(*sight.camera, sight.u_px - sight.offset_px);
  if (!direction) return false;
  sight.r = p_C_mm.z() * direction->head<2>() - p_C_mm.head<2>();
  Matrix23 by_p_C;
  by_p_C << 1, 0, -direction->x(), 0, 1, -direction->y();
  sight.A = by_p_C * sight.R_CW;
  return true;
}

bool PoseModel::linearise(const CentredPose& pose, NormalEquations& equations) {
  equations = {};
  for (Sight& sight : sights_) {
    if (!sight.active) continue;
    sight.visible = linearise(pose, sight);
    if (!sight.visible) return false;
    equations.N.noalias() += sight.WJ * sight.WJ.transpose();
    equations.g.noalias() += sight.WJ * sight.Wr;
    equations.cost += sight.Wr.squaredNorm();
  }
  return true;
}

void PoseModel::linearise_unused(const CentredPose& pose) {
  for (Sight& sight : sights_)
    if (!sight.active) sight.visible = linearise(pose, sight);
}

Matrix2d PoseModel::own_covariance(const Sight& sight) const {
  if (residual_ == Residual::reprojection) return sight.covariance_px2;
  // The ray's derivative by the pixel is the inverse of the pixel's by the ray.
  const auto direction = ray(*sight.camera, sight.u_px - sight.offset_px);
  const auto projection = direction ? project_with_jacobian(*sight.camera, *direction) : std::nullopt;
  if (!projection) return sight.covariance_px2;
  const Matrix2d mm_per_px = sight.depth_mm * projection->du_dp.leftCols<2>().inverse();
  return mm_per_px * sight.covariance_px2 * mm_per_px.transpose();
}

Matrix2d PoseModel::total_covariance(const Sight& sight) const {
  Matrix2d total = own_covariance(sight);
  const double variance_mm2 = sight.mark->sigma_mm * sight.mark->sigma_mm;
  if (variance_mm2 > 0) total += variance_mm2 * sight.A * sight.A.transpose();
  if (residual_ == Residual::reprojection) {
    total.diagonal().array() += system_variance_px2_;
    return total;
  }
  const Vector2d mm_per_px(sight.depth_mm / sight.camera->fx_px, sight.depth_mm / sight.camera->fy_px);
  return total + Matrix2d((system_variance_px2_ * mm_per_px.cwiseAbs2()).asDiagonal());
}

}  // namespace zeropose
