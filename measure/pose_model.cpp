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
using Lanes2 = std::array<Lanes, 2>;
using Lanes3 = std::array<Lanes, 3>;
using Lanes6 = std::array<Lanes, 6>;

CentredPose moved(const CentredPose& pose, const Vector6& delta) {
  return {exp_so3(delta.tail<3>()) * pose.R_WO, pose.p_WM_mm + delta.head<3>()};
}

namespace {

// The lens' part of the eccentricity changes by about 1e-5 px per mm.
constexpr double bend_move_mm = 0.02;

// W with W' W = C^-1, upper triangle.
Vector3d whitening_of(const Matrix2d& C) {
  const double determinant = C(0, 0) * C(1, 1) - C(0, 1) * C(0, 1);
  const double w11 = std::sqrt(C(1, 1) / determinant), w22 = 1 / std::sqrt(C(1, 1));
  return {w11, -C(0, 1) / C(1, 1) * w11, w22};
}

Lanes3 turned(const Matrix3d& R, const Lanes3& v) {
  Lanes3 result;
  for (std::size_t k = 0; k < 3; ++k) {
    const auto row = static_cast<Eigen::Index>(k);
    result[k] = R(row, 0) * v[0] + R(row, 1) * v[1] + R(row, 2) * v[2];
  }
  return result;
}

Lanes3 turned(const std::array<Lanes, 9>& R, const Lanes3& v) {
  Lanes3 result;
  for (std::size_t k = 0; k < 3; ++k) result[k] = R[3 * k] * v[0] + R[3 * k + 1] * v[1] + R[3 * k + 2] * v[2];
  return result;
}

bool all_positive(const Lanes& lanes) {
  bool positive = true;
  for (std::size_t k = 0; k < lane_count; ++k) positive &= lanes[static_cast<Eigen::Index>(k)] > 0;
  return positive;
}

// Where the centre of a mark's outline is seen in the camera without a lens, by depth2 of the mark: from the
// dual conic of the outline (calib/eccentricity.h).
struct OutlineCentre {
  Lanes depth2, x, y;
};

OutlineCentre outline_centre(const SightBlock& block, const Lanes3& p, const Lanes3& n) {
  const Lanes depth2 = p[2] * p[2] - block.radius2_mm2 * (1 - n[2] * n[2]);
  const Lanes along = block.radius2_mm2 * n[2];
  return {depth2, (p[2] * p[0] + along * n[0]) / depth2, (p[2] * p[1] + along * n[1]) / depth2};
}

// The division lens (calib/camera_model.h) on both lanes: the pixel where the mark is seen, and the
// derivative of the pixel by the mark's position in the camera, whitened. False where one has no image.
bool project_division(const SightBlock& block, const Lanes3& p, const Lanes3* normal, Lanes2& pixel,
                      Lanes6& WD) {
  if (!all_positive(p[2])) return false;
  const Lanes inverse_z = 1 / p[2], x = p[0] * inverse_z, y = p[1] * inverse_z;
  const Lanes square = 1 - 4 * block.K * (x * x + y * y);
  if (!all_positive(square)) return false;
  const Lanes root = square.sqrt(), factor = 2 / (1 + root);
  const Lanes slope = 2 * block.K * factor * factor / root;
  if (normal == nullptr) {
    pixel[0] = block.focal_px[0] * factor * x + block.origin_px[0];
    pixel[1] = block.focal_px[1] * factor * y + block.origin_px[1];
  } else {
    const OutlineCentre centre = outline_centre(block, p, *normal);
    const Lanes square_there = 1 - 4 * block.K * (centre.x * centre.x + centre.y * centre.y);
    if (!all_positive(centre.depth2) || !all_positive(square_there)) return false;
    const Lanes factor_there = 2 / (1 + square_there.sqrt());
    pixel[0] = block.focal_px[0] * factor_there * centre.x + block.origin_px[0] + block.bend_px[0];
    pixel[1] = block.focal_px[1] * factor_there * centre.y + block.origin_px[1] + block.bend_px[1];
  }
  const Lanes scale_x = block.focal_px[0] * inverse_z, scale_y = block.focal_px[1] * inverse_z;
  const Lanes cross = slope * x * y;
  const Lanes d11 = scale_x * (factor + slope * x * x), d12 = scale_x * cross;
  const Lanes d21 = scale_y * cross, d22 = scale_y * (factor + slope * y * y);
  const Lanes3& W = block.whitening;
  WD[0] = W[0] * d11 + W[1] * d21;
  WD[1] = W[0] * d12 + W[1] * d22;
  WD[2] = -(WD[0] * x + WD[1] * y);
  WD[3] = W[2] * d21;
  WD[4] = W[2] * d22;
  WD[5] = -(WD[3] * x + WD[4] * y);
  return true;
}

// A row of W J from one of W D: a = WD R_CW, b = q x a / extent.
void fill_row(const std::array<Lanes, 9>& R, const Lanes* WD, const Lanes3& q_share, Lanes6& row) {
  for (std::size_t k = 0; k < 3; ++k) row[k] = WD[0] * R[k] + WD[1] * R[3 + k] + WD[2] * R[6 + k];
  row[3] = q_share[1] * row[2] - q_share[2] * row[1];
  row[4] = q_share[2] * row[0] - q_share[0] * row[2];
  row[5] = q_share[0] * row[1] - q_share[1] * row[0];
}

struct Sums {
  std::array<Lanes, 21> N;
  Lanes6 g;
  Lanes cost = Lanes::Zero();

  Sums() {
    N.fill(Lanes::Zero());
    g.fill(Lanes::Zero());
  }

  void add(const SightBlock& block) {
    const Lanes r1 = block.active * block.Wr[0], r2 = block.active * block.Wr[1];
    cost += r1 * r1 + r2 * r2;
    std::size_t at = 0;
#pragma GCC unroll 6
    for (std::size_t i = 0; i < 6; ++i) {
      const Lanes a1 = block.active * block.row1[i], a2 = block.active * block.row2[i];
      g[i] += a1 * r1 + a2 * r2;
#pragma GCC unroll 6
      for (std::size_t j = 0; j <= i; ++j) N[at++] += a1 * block.row1[j] + a2 * block.row2[j];
    }
  }

  void store(NormalEquations& equations) const {
    std::size_t at = 0;
    for (Eigen::Index i = 0; i < 6; ++i) {
      equations.g[i] = g[static_cast<std::size_t>(i)].sum();
      for (Eigen::Index j = 0; j <= i; ++j) equations.N(i, j) = equations.N(j, i) = N[at++].sum();
    }
    equations.cost = cost.sum();
  }
};

void put(std::size_t lane, const Vector3d& v, Lanes3& lanes) {
  for (std::size_t k = 0; k < 3; ++k)
    lanes[k][static_cast<Eigen::Index>(lane)] = v[static_cast<Eigen::Index>(k)];
}

void put(std::size_t lane, const Vector2d& v, Lanes2& lanes) {
  lanes[0][static_cast<Eigen::Index>(lane)] = v.x();
  lanes[1][static_cast<Eigen::Index>(lane)] = v.y();
}

}  // namespace

PoseModel::PoseModel(const PoseProblem& problem)
    : problem_(problem),
      block_count_((problem.observations.size() + lane_count - 1) / lane_count),
      blocks_(std::make_unique_for_overwrite<SightBlock[]>(block_count_)),
      algebraic_(problem.residual == Residual::algebraic),
      planar_(problem.X_WP_planar.has_value()),
      plain_(!algebraic_ && problem.system_sigma_px == 0),
      system_variance_px2_(problem.system_sigma_px * problem.system_sigma_px) {
  if (planar_) {
    X_WP_ = *problem.X_WP_planar;
    planar_basis_.topLeftCorner<3, 2>() = X_WP_.linear().leftCols<2>();
    planar_basis_.bottomRightCorner<3, 1>() = X_WP_.linear().col(2);
  }
  for (std::size_t i = 0; i < size(); ++i) fill(i, observation(i));
  // What is left of the last block is a shadow of the last observation, without weight.
  for (std::size_t i = size(); i < lane_count * block_count_; ++i) {
    fill(i, problem.observations.back());
    set_active(i, false);
    for (Lanes& w : blocks_[block_count_ - 1].whitening) w[static_cast<Eigen::Index>(lane(i))] = 0;
  }
  centre();
}

void PoseModel::fill(std::size_t i, const Observation& seen) {
  const CalibratedCamera& from = problem_.cameras[seen.camera];
  const Mark& what = problem_.marks[seen.mark];
  SightBlock& b = blocks_[i / lane_count];
  const std::size_t at = lane(i);
  const auto k = static_cast<Eigen::Index>(at);
  const Matrix3d R_CW = from.X_WC.linear().transpose();
  for (Eigen::Index row = 0; row < 3; ++row)
    for (Eigen::Index column = 0; column < 3; ++column)
      b.R_CW[static_cast<std::size_t>(3 * row + column)][k] = R_CW(row, column);
  put(at, -(R_CW * from.X_WC.translation()), b.p_CW_mm);
  put(at, Vector2d(from.model.fx_px, from.model.fy_px), b.focal_px);
  put(at, Vector2d(from.model.cx_px, from.model.cy_px), b.origin_px);
  put(at, seen.u_px, b.u_px);
  const auto* division = std::get_if<Division>(&from.model.distortion);
  b.K[k] = division != nullptr ? division->K : 0;
  one_lens_ = one_lens_ && division != nullptr;
  const double weight = what.weight > 0 ? what.weight : 1;
  put(at, weight * (algebraic_ ? Vector3d(1, 0, 1) : whitening_of(seen.covariance_px2)), b.whitening);
  b.weight[k] = weight;
  b.active[k] = what.weight > 0 ? 1 : 0;
  plain_ = plain_ && weight == 1 && what.sigma_mm == 0;
  const bool disc = has_image_offset(what);
  const double radius_mm = disc ? seen.radius_share * what.radius_mm : 0;
  b.radius2_mm2[k] = radius_mm * radius_mm;
  const bool flat = disc && what.kind != MarkKind::ball;
  put(at, flat ? what.normal_O.normalized() : Vector3d(0, 0, 0), b.normal_O);
  put(at, Vector2d(0, 0), b.bend_px);
  has_discs_ = has_discs_ || disc;
}

// The centroid and the extent of the marks of weight.
void PoseModel::centre() {
  double count = 0, squares = 0;
  for (std::size_t i = 0; i < size(); ++i) {
    if (!active(i)) continue;
    ++count;
    centroid_O_mm_ += mark(i).p_O_mm;
  }
  if (count > 0) centroid_O_mm_ /= count;
  for (std::size_t i = 0; i < lane_count * block_count_; ++i) {
    const Vector3d p_MQ = p_MQ_mm(std::min(i, size() - 1));
    put(lane(i), p_MQ, blocks_[i / lane_count].p_MQ_mm);
    if (active(i)) squares += p_MQ.squaredNorm();
  }
  if (squares > 0) extent_mm_ = std::sqrt(squares / count);
}

int PoseModel::active_count() const {
  double count = 0;
  for (const SightBlock& block : blocks()) count += block.active.sum();
  return static_cast<int>(count);
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

bool PoseModel::bends_are_old(const CentredPose& pose) const {
  if (!has_discs_) return false;
  return !bends_known_ ||
         (pose.p_WM_mm - bends_at_.p_WM_mm).norm() + extent_mm_ * (pose.R_WO - bends_at_.R_WO).norm() >
             bend_move_mm;
}

void PoseModel::refresh_bends(const CentredPose& pose) {
  bends_known_ = true;
  bends_at_ = pose;
  for (std::size_t i = 0; i < size(); ++i) {
    SightBlock& b = blocks_[i / lane_count];
    const auto k = static_cast<Eigen::Index>(lane(i));
    if (!(b.radius2_mm2[k] > 0)) continue;
    const Pose& X_WC = camera(i).X_WC;
    const CameraModel& model = camera(i).model;
    const Vector3d p_C =
        X_WC.linear().transpose() * (pose.R_WO * p_MQ_mm(i) + pose.p_WM_mm - X_WC.translation());
    const Vector3d n_C = X_WC.linear().transpose() * (pose.R_WO * mark(i).normal_O);
    Lanes3 p, n;
    put(lane(i), p_C, p);
    put(lane(i), mark(i).kind == MarkKind::ball ? Vector3d(0, 0, 0) : n_C.normalized(), n);
    const OutlineCentre centre = outline_centre(b, p, n);
    const auto from = project(model, p_C), to = project(model, {centre.x[k], centre.y[k], 1});
    Vector2d bend(0, 0);
    if (from && to && centre.depth2[k] > 0)
      bend = image_offset(model, mark(i), p_C, n_C, observation(i).radius_share) - (*to - *from);
    put(lane(i), bend, b.bend_px);
  }
}

// Any lens, algebraic residuals, and marks without an image, one by one.
void PoseModel::linearise_lane(const Lanes3& p, const Lanes3& n, std::size_t i, Lanes6& WD) {
  SightBlock& b = blocks_[i / lane_count];
  const auto k = static_cast<Eigen::Index>(lane(i));
  const CameraModel& model = camera(std::min(i, size() - 1)).model;
  const Vector3d p_C(p[0][k], p[1][k], p[2][k]);
  const auto projection = project_with_jacobian(model, p_C);
  Vector2d seen(0, 0);
  if (projection) seen = projection->u_px;
  if (projection && b.radius2_mm2[k] > 0) {
    const OutlineCentre centre = outline_centre(b, p, n);
    const auto there = project(model, {centre.x[k], centre.y[k], 1});
    if (there && centre.depth2[k] > 0) seen = *there + Vector2d(b.bend_px[0][k], b.bend_px[1][k]);
  }
  const Vector2d u_px(b.u_px[0][k], b.u_px[1][k]), dev_px = u_px - seen;
  Eigen::Matrix<double, 2, 3> D;
  Vector2d r = dev_px;
  bool visible = projection.has_value();
  if (visible) D = projection->du_dp;
  if (visible && algebraic_) {
    // (zc x - xc, zc y - yc) with the found direction (x, y): the source's residual, in mm.
    const auto direction = ray(model, u_px - (seen - projection->u_px));
    visible = direction.has_value();
    if (visible) {
      r = p_C.z() * direction->head<2>() - p_C.head<2>();
      D << 1, 0, -direction->x(), 0, 1, -direction->y();
    }
  }
  b.visible[lane(i)] = visible;
  if (!visible) r.setZero(), D.setZero();
  Matrix2d W;
  W << b.whitening[0][k], b.whitening[1][k], 0, b.whitening[2][k];
  const Eigen::Matrix<double, 2, 3> whitened = W * D;
  for (Eigen::Index column = 0; column < 3; ++column) {
    WD[static_cast<std::size_t>(column)][k] = whitened(0, column);
    WD[static_cast<std::size_t>(3 + column)][k] = whitened(1, column);
  }
  put(lane(i), dev_px, b.dev_px);
  put(lane(i), W * r, b.Wr);
}

bool PoseModel::linearise(const CentredPose& pose, NormalEquations& equations) {
  Sums sums;
  bool visible = true;
  for (std::size_t at = 0; at < block_count_; ++at) {
    SightBlock& b = blocks_[at];
    Lanes3 q = turned(pose.R_WO, b.p_MQ_mm), normal_C, p_C;
    p_C = turned(b.R_CW, {q[0] + pose.p_WM_mm.x(), q[1] + pose.p_WM_mm.y(), q[2] + pose.p_WM_mm.z()});
    for (std::size_t k = 0; k < 3; ++k) p_C[k] += b.p_CW_mm[k];
    if (has_discs_) normal_C = turned(b.R_CW, turned(pose.R_WO, b.normal_O));
    b.depth_mm = p_C[2];
    Lanes2 pixel;
    Lanes6 WD;
    if (one_lens_ && !algebraic_ && project_division(b, p_C, has_discs_ ? &normal_C : nullptr, pixel, WD)) {
      b.visible.fill(true);
      for (std::size_t k = 0; k < 2; ++k) b.dev_px[k] = b.u_px[k] - pixel[k];
      b.Wr[0] = b.whitening[0] * b.dev_px[0] + b.whitening[1] * b.dev_px[1];
      b.Wr[1] = b.whitening[2] * b.dev_px[1];
    } else {
      for (std::size_t k = 0; k < lane_count; ++k) {
        linearise_lane(p_C, normal_C, lane_count * at + k, WD);
        visible = visible && (b.visible[k] || !(b.active[static_cast<Eigen::Index>(k)] > 0));
      }
    }
    for (Lanes& number : q) number /= extent_mm_;
    fill_row(b.R_CW, WD.data(), q, b.row1);
    fill_row(b.R_CW, WD.data() + 3, q, b.row2);
    sums.add(b);
  }
  sums.store(equations);
  return visible && std::isfinite(equations.cost);
}

}  // namespace zeropose
