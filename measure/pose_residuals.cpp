// What PoseModel says of single observations at its last linearisation, and their covariances.
#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "measure/pose_model.h"

namespace zeropose {

using Eigen::Matrix2d;
using Eigen::Vector2d;
using Lanes2 = std::array<Lanes, 2>;
using Lanes3 = std::array<Lanes, 3>;

double PoseModel::rms_rad() const {
  Lanes squares = Lanes::Zero(), count = Lanes::Zero();
  for (const SightBlock& b : blocks()) {
    count += b.active;
    squares +=
        b.active * (b.dev_px[0] * b.dev_px[0] + b.dev_px[1] * b.dev_px[1]) / (b.focal_px[0] * b.focal_px[0]);
  }
  return std::sqrt(squares.sum() / count.sum());
}

Vector2d PoseModel::dev_mm(std::size_t i) const {
  const CameraModel& model = camera(i).model;
  const double depth_mm = block(i).depth_mm[static_cast<Eigen::Index>(lane(i))];
  return dev_px(i).cwiseQuotient(Vector2d(model.fx_px, model.fy_px)) * depth_mm;
}

Eigen::Matrix<double, 2, 6> PoseModel::WJ(std::size_t i) const {
  Eigen::Matrix<double, 2, 6> WJ;
  for (std::size_t k = 0; k < 6; ++k) {
    WJ(0, static_cast<Eigen::Index>(k)) = block(i).row1[k][static_cast<Eigen::Index>(lane(i))];
    WJ(1, static_cast<Eigen::Index>(k)) = block(i).row2[k][static_cast<Eigen::Index>(lane(i))];
  }
  return WJ;
}

// Of an algebraic residual: the ray's derivative by the pixel is the inverse of the pixel's by the ray.
Matrix2d PoseModel::own_covariance_mm2(std::size_t i) const {
  const CameraModel& model = camera(i).model;
  const double depth_mm = block(i).depth_mm[static_cast<Eigen::Index>(lane(i))];
  const auto direction = ray(model, observation(i).u_px);
  const auto projection = direction ? project_with_jacobian(model, *direction) : std::nullopt;
  if (!projection) return observation(i).covariance_px2;
  const Matrix2d mm_per_px = depth_mm * projection->du_dp.leftCols<2>().inverse();
  return mm_per_px * observation(i).covariance_px2 * mm_per_px.transpose();
}

void PoseModel::refresh_covariances() {
  for (std::size_t at = 0; at < block_count_; ++at) {
    SightBlock& b = blocks_[at];
    const Lanes weight2 = b.weight * b.weight;
    b.own = {weight2, Lanes::Zero(), weight2};
    Lanes2 system{Lanes::Constant(system_variance_px2_), Lanes::Constant(system_variance_px2_)};
    Lanes variance_mm2 = Lanes::Zero();
    for (std::size_t k = 0; k < lane_count; ++k) {
      const std::size_t i = std::min(lane_count * at + k, size() - 1);
      const auto index = static_cast<Eigen::Index>(k);
      variance_mm2[index] = mark(i).sigma_mm * mark(i).sigma_mm;
      if (!algebraic_) continue;
      const Matrix2d own = weight2[index] * own_covariance_mm2(i);
      b.own[0][index] = own(0, 0), b.own[1][index] = own(0, 1), b.own[2][index] = own(1, 1);
      for (std::size_t axis = 0; axis < 2; ++axis)
        system[axis][index] *= std::pow(b.depth_mm[index] / b.focal_px[axis][index], 2);
    }
    const Lanes3& W = b.whitening;
    b.total = {b.own[0] + W[0] * W[0] * system[0] + W[1] * W[1] * system[1],
               b.own[1] + W[1] * W[2] * system[1], b.own[2] + W[2] * W[2] * system[1]};
    for (std::size_t k = 0; k < 3; ++k) {
      b.total[0] += variance_mm2 * b.row1[k] * b.row1[k];
      b.total[1] += variance_mm2 * b.row1[k] * b.row2[k];
      b.total[2] += variance_mm2 * b.row2[k] * b.row2[k];
    }
  }
}

Matrix2d PoseModel::total_covariance(std::size_t i) const {
  if (plain_) return Matrix2d::Identity();
  const auto k = static_cast<Eigen::Index>(lane(i));
  const Lanes3& total = block(i).total;
  Matrix2d C;
  C << total[0][k], total[1][k], total[1][k], total[2][k];
  return C;
}

}  // namespace zeropose
