#include <cmath>
#include <limits>

#include "calib/views_bundle.h"

namespace zeropose::bundle {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;
using Sums = Eigen::Matrix<double, columns + 1, columns + 1>;
using Rows = Eigen::Matrix<double, columns + 1, 2>;  // transposed

struct Loss {
  double cost, weight;
};

// Cauchy: c^2 log(1 + s / c^2).
Loss loss_of(double square, double width) {
  if (!(width > 0)) return {square, 1};
  const double c2 = width * width;
  return {c2 * std::log1p(square / c2), 1 / (1 + square / c2)};
}

// sums += rows weighted^T, the lower triangle in blocks of four columns: fixed sizes, which the compiler
// vectorises.
template <int first = 0>
void add_lower(Sums& sums, const Rows& rows, const Rows& weighted) {
  constexpr int rest = columns + 1 - first;
  sums.block<rest, 4>(first, first) +=
      rows.bottomRows<rest>().lazyProduct(weighted.middleRows<4>(first).transpose());
  if constexpr (first + 4 < columns + 1) add_lower<first + 4>(sums, rows, weighted);
}

}  // namespace

std::optional<Equations> equations_of(const CameraModel& model, const Pose& X_CB,
                                      std::span<const SeenPoint> points, double loss) {
  static_assert((columns + 1) % 4 == 0);
  Equations equations{Sums::Zero(), 0};
  const Matrix3d R = X_CB.linear();
  const Vector3d t = X_CB.translation();
  for (const SeenPoint& point : points) {
    const Vector3d arm = R * point.p_B_mm;
    const auto projection = project_with_all_jacobians(model, arm + t);
    if (!projection) return std::nullopt;
    Rows rows;
    const Eigen::Matrix<double, 2, 3> J = point.whiten * projection->du_dp;
    rows.topRows<internals_count>() = (point.whiten * projection->du_di).transpose();
    rows.middleRows<3>(internals_count) = J.transpose();
    // J (w x arm) = (arm x J) . w, row by row.
    rows.middleRows<3>(internals_count + 3) << arm.cross(J.row(0).transpose()),
        arm.cross(J.row(1).transpose());
    const Vector2d r = point.whiten * (projection->u_px - point.u_px);
    rows.bottomRows<1>() = r.transpose();
    const Loss robust = loss_of(r.squaredNorm(), loss);
    equations.cost += robust.cost;
    add_lower(equations.sums, rows, robust.weight * rows);
  }
  equations.sums.triangularView<Eigen::StrictlyUpper>() = equations.sums.transpose();
  if (!std::isfinite(equations.cost)) return std::nullopt;
  return equations;
}

std::optional<double> cost_of(const CameraModel& model, const Pose& X_CB, std::span<const SeenPoint> points,
                              double loss) {
  double cost = 0;
  const Matrix3d R = X_CB.linear();
  const Vector3d t = X_CB.translation();
  for (const SeenPoint& point : points) {
    const auto u_px = project(model, R * point.p_B_mm + t);
    if (!u_px) return std::nullopt;
    cost += loss_of((point.whiten * (*u_px - point.u_px)).squaredNorm(), loss).cost;
  }
  if (!std::isfinite(cost)) return std::nullopt;
  return cost;
}

double cost_of(const State& state, std::span<const Chunk> chunks, double loss) {
  double sum = 0;
  for (const Chunk& chunk : chunks)
    sum += cost_of(state.models[chunk.camera], state.X_WC[chunk.camera].inverse() * state.X_WB[chunk.view],
                   chunk.points, loss)
               .value_or(std::numeric_limits<double>::infinity());
  return sum;
}

Matrix6 by_camera(const Pose& X_WC, const Pose& X_WB) {
  const Matrix3d R_CW = X_WC.linear().transpose();
  Matrix6 A = Matrix6::Zero();
  A.topLeftCorner<3, 3>() = A.bottomRightCorner<3, 3>() = -R_CW;
  A.topRightCorner<3, 3>() = R_CW * cross_matrix(X_WB.translation() - X_WC.translation());
  return A;
}

Matrix6 by_view(const Pose& X_WC) {
  Matrix6 A = Matrix6::Zero();
  A.topLeftCorner<3, 3>() = A.bottomRightCorner<3, 3>() = X_WC.linear().transpose();
  return A;
}

}  // namespace zeropose::bundle
