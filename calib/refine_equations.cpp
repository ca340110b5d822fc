#include "calib/refine_equations.h"

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>

namespace zeropose {
namespace {

constexpr int block = 8;  // points at a time
using Column = Eigen::Array<double, block, 1>;
template <int n>
using Rows = Eigen::Array<double, block, n>;

// The distorted point (dx, dy) by the undistorted one (x, y) and by the lens' parameters.
template <int n>
struct Bent {
  Column dx, dy;
  Column xx, xy, yy;  // d(dx)/dx, d(dx)/dy = d(dy)/dx, d(dy)/dy
  Rows<n> dx_lens, dy_lens;
  bool visible = true;
};

// (E2) of spec 20; see camera_model.cpp for the scalar form.
struct DivisionLens {
  static constexpr int size = 1;
  double K;

  explicit DivisionLens(const Division& lens) : K(lens.K) {}

  Bent<1> bend(const Column& x, const Column& y) const {
    Bent<1> bent;
    const Column r2 = x.square() + y.square();
    const Column inner = 1 - 4 * K * r2;
    bent.visible = inner.minCoeff() > 0;
    const Column root = inner.sqrt();
    const Column factor = 2 / (1 + root);
    const Column slope = factor.square() / root;  // d(factor)/d(K r2)
    bent.dx = factor * x;
    bent.dy = factor * y;
    bent.xx = factor + 2 * K * slope * x.square();
    bent.xy = 2 * K * slope * x * y;
    bent.yy = factor + 2 * K * slope * y.square();
    bent.dx_lens = slope * r2 * x;
    bent.dy_lens = slope * r2 * y;
    return bent;
  }
};

struct BrownLens {
  static constexpr int size = 5;
  BrownConrady lens;

  explicit BrownLens(const BrownConrady& brown) : lens(brown) {}

  Bent<5> bend(const Column& x, const Column& y) const {
    Bent<5> bent;
    const Column r2 = x.square() + y.square();
    const Column radial = 1 + r2 * (lens.k1 + r2 * (lens.k2 + r2 * lens.k3));
    const Column slope = lens.k1 + r2 * (2 * lens.k2 + r2 * (3 * lens.k3));
    bent.visible = (radial + 2 * r2 * slope).minCoeff() > 0;
    bent.dx = radial * x + 2 * lens.p1 * x * y + lens.p2 * (r2 + 2 * x.square());
    bent.dy = radial * y + lens.p1 * (r2 + 2 * y.square()) + 2 * lens.p2 * x * y;
    bent.xx = radial + 2 * slope * x.square() + 2 * lens.p1 * y + 6 * lens.p2 * x;
    bent.xy = 2 * slope * x * y + 2 * lens.p1 * x + 2 * lens.p2 * y;
    bent.yy = radial + 2 * slope * y.square() + 6 * lens.p1 * y + 2 * lens.p2 * x;
    bent.dx_lens << r2 * x, r2.square() * x, 2 * x * y, r2 + 2 * x.square(), r2.cube() * x;
    bent.dy_lens << r2 * y, r2.square() * y, r2 + 2 * y.square(), 2 * x * y, r2.cube() * y;
    return bent;
  }
};

// A block's points in the world, relative to the camera, and in its frame.
struct Seen {
  Column wx, wy, wz;
  Column cx, cy, cz;

  Seen(const PointColumns& points, Eigen::Index first, const Pose& X_WC) {
    const Eigen::Vector3d p = X_WC.translation();
    const Eigen::Matrix3d R = X_WC.linear();
    wx = points.x_mm.segment<block>(first) - p.x();
    wy = points.y_mm.segment<block>(first) - p.y();
    wz = points.z_mm.segment<block>(first) - p.z();
    cx = R(0, 0) * wx + R(1, 0) * wy + R(2, 0) * wz;
    cy = R(0, 1) * wx + R(1, 1) * wy + R(2, 1) * wz;
    cz = R(0, 2) * wx + R(1, 2) * wy + R(2, 2) * wz;
  }

  // The pose's six columns from the derivative gx, gy, gz by the point in the camera's frame. With a = R g in
  // the world's axes the translation has -a, the rotation a x (p_W - p_WC): see moved().
  template <class Target>
  void add_pose_columns(Target&& rows, const Eigen::Matrix3d& R, const Column& gx, const Column& gy,
                        const Column& gz) const {
    const Column ax = R(0, 0) * gx + R(0, 1) * gy + R(0, 2) * gz;
    const Column ay = R(1, 0) * gx + R(1, 1) * gy + R(1, 2) * gz;
    const Column az = R(2, 0) * gx + R(2, 1) * gy + R(2, 2) * gz;
    rows.col(0) = -ax;
    rows.col(1) = -ay;
    rows.col(2) = -az;
    rows.col(3) = ay * wz - az * wy;
    rows.col(4) = az * wx - ax * wz;
    rows.col(5) = ax * wy - ay * wx;
  }
};

// One of the two residuals of a block's points, and its derivative by those parameters it depends on.
template <int n>
struct Residuals {
  Column r;
  Rows<n> J;
  std::array<int, static_cast<std::size_t>(n)> places;  // of the columns of J among all parameters
};

// Adds J' W J and J' W r into their places of the whole, the lower triangle by places.
template <int n>
void add_own(const Residuals<n>& a, const Column& w, ViewEquations& sum) {
  for (int i = 0; i < n; ++i) {
    const int row = a.places[static_cast<std::size_t>(i)];
    const Column weighted = a.J.col(i) * w;
    sum.g(row) += (weighted * a.r).sum();
    for (int j = 0; j <= i; ++j)
      sum.N(row, a.places[static_cast<std::size_t>(j)]) += (weighted * a.J.col(j)).sum();
  }
}

// The same for the covariance between the two residuals.
template <int n>
void add_mixed(const Residuals<n>& a, const Residuals<n>& b, const Column& w, ViewEquations& sum) {
  for (int i = 0; i < n; ++i) {
    const int row = a.places[static_cast<std::size_t>(i)];
    const Column weighted = a.J.col(i) * w;
    sum.g(row) += (weighted * b.r).sum();
    sum.g(b.places[static_cast<std::size_t>(i)]) += (w * b.J.col(i) * a.r).sum();
    for (int j = 0; j < n; ++j) {
      const int column = b.places[static_cast<std::size_t>(j)];
      const double product = (weighted * b.J.col(j)).sum();
      // It stands in both triangles, on the diagonal twice.
      if (row >= column) sum.N(row, column) += product;
      if (row <= column) sum.N(column, row) += product;
    }
  }
}

template <int n>
void add_both(const Residuals<n>& u, const Residuals<n>& v, const PointColumns& points, Eigen::Index first,
              double robust, ViewEquations& sum) {
  Column wuu = points.wuu.segment<block>(first), wvv = points.wvv.segment<block>(first);
  Column wuv = points.wuv.segment<block>(first);
  const Column square = wuu * u.r.square() + wvv * v.r.square() + 2 * wuv * u.r * v.r;
  if (robust > 0) {
    const double scale = robust * robust;
    const Column trust = 1 / (1 + square / scale);
    wuu *= trust;
    wuv *= trust;
    wvv *= trust;
    sum.cost += scale * (1 + square / scale).log().sum();
  } else {
    sum.cost += square.sum();
  }
  add_own(u, wuu, sum);
  add_own(v, wvv, sum);
  if (points.correlated) add_mixed(u, v, wuv, sum);
}

template <class Lens>
bool add_reprojection(const PointColumns& points, Eigen::Index first, const CameraModel& camera,
                      const Lens& lens, const Pose& X_WC, double robust, ViewEquations& sum) {
  constexpr int n = Lens::size + 8;
  const Seen seen(points, first, X_WC);
  if (!(seen.cz.minCoeff() > 0)) return false;
  const Eigen::Matrix3d R = X_WC.linear();
  const Column iz = 1 / seen.cz, x = seen.cx * iz, y = seen.cy * iz;
  const auto bent = lens.bend(x, y);
  if (!bent.visible) return false;
  Residuals<n> u, v;
  // u does not depend on fy and cy, nor v on fx and cx.
  u.places = {0, 2};
  v.places = {1, 3};
  for (std::size_t k = 2; k < u.places.size(); ++k) u.places[k] = v.places[k] = static_cast<int>(k) + 2;
  u.r = points.u_px.segment<block>(first) - (camera.fx_px * bent.dx + camera.cx_px);
  v.r = points.v_px.segment<block>(first) - (camera.fy_px * bent.dy + camera.cy_px);
  u.J.col(0) = bent.dx;
  v.J.col(0) = bent.dy;
  u.J.col(1).setOnes();
  v.J.col(1).setOnes();
  u.J.middleCols(2, Lens::size) = camera.fx_px * bent.dx_lens;
  v.J.middleCols(2, Lens::size) = camera.fy_px * bent.dy_lens;
  const Column fx_z = camera.fx_px * iz, fy_z = camera.fy_px * iz;
  seen.add_pose_columns(u.J.rightCols(6), R, fx_z * bent.xx, fx_z * bent.xy,
                        -fx_z * (bent.xx * x + bent.xy * y));
  seen.add_pose_columns(v.J.rightCols(6), R, fy_z * bent.xy, fy_z * bent.yy,
                        -fy_z * (bent.xy * x + bent.yy * y));
  add_both(u, v, points, first, robust, sum);
  return true;
}

// zc (u - Cx) - xc fx (1 + K r2), r2 of the observed point, and the same with v: spec 30 C6. The residuals
// here are found minus predicted as above, so the derivatives have the opposite sign.
bool add_algebraic(const PointColumns& points, Eigen::Index first, const CameraModel& camera, double K,
                   const Pose& X_WC, double robust, ViewEquations& sum) {
  constexpr int n = 11;
  const Seen seen(points, first, X_WC);
  if (!(seen.cz.minCoeff() > 0)) return false;
  const Eigen::Matrix3d R = X_WC.linear();
  const Column X = points.u_px.segment<block>(first) - camera.cx_px;
  const Column Y = points.v_px.segment<block>(first) - camera.cy_px;
  const Column xd = X / camera.fx_px, yd = Y / camera.fy_px, r2 = xd.square() + yd.square();
  const Column bend = 1 + K * r2, zero = Column::Zero();
  const auto fill = [&](const Column& pixel, const Column& c, double f, bool is_u) {
    Residuals<n> rows;
    rows.r = seen.cz * pixel - c * f * bend;
    for (std::size_t k = 0; k < rows.places.size(); ++k) rows.places[k] = static_cast<int>(k);
    rows.J.col(0) = -2 * c * K * f / camera.fx_px * xd.square();
    rows.J.col(1) = -2 * c * K * f / camera.fy_px * yd.square();
    rows.J.col(is_u ? 0 : 1) += c * bend;
    rows.J.col(2) = -2 * c * K * f / camera.fx_px * xd;
    rows.J.col(3) = -2 * c * K * f / camera.fy_px * yd;
    rows.J.col(is_u ? 2 : 3) += seen.cz;
    rows.J.col(4) = c * f * r2;
    const Column side = f * bend, depth = -pixel;
    seen.add_pose_columns(rows.J.rightCols(6), R, is_u ? side : zero, is_u ? zero : side, depth);
    return rows;
  };
  add_both(fill(X, seen.cx, camera.fx_px, true), fill(Y, seen.cy, camera.fy_px, false), points, first, robust,
           sum);
  return true;
}

bool add_block(const PointColumns& points, Eigen::Index first, const CameraModel& camera, const Pose& X_WC,
               const Objective& objective, ViewEquations& sum) {
  if (const auto* division = std::get_if<Division>(&camera.distortion)) {
    if (objective.residual == Residual::algebraic)
      return add_algebraic(points, first, camera, division->K, X_WC, objective.robust, sum);
    return add_reprojection(points, first, camera, DivisionLens(*division), X_WC, objective.robust, sum);
  }
  return add_reprojection(points, first, camera, BrownLens(std::get<BrownConrady>(camera.distortion)), X_WC,
                          objective.robust, sum);
}

}  // namespace

PointColumns columns_of(std::span<const CalibrationPoint> points) {
  PointColumns columns;
  const auto n = static_cast<Eigen::Index>(points.size());
  const Eigen::Index padded = (n + block - 1) / block * block;
  for (Eigen::ArrayXd* column : {&columns.x_mm, &columns.y_mm, &columns.z_mm, &columns.u_px, &columns.v_px,
                                 &columns.wuu, &columns.wuv, &columns.wvv})
    column->resize(padded);
  for (Eigen::Index i = 0; i < padded; ++i) {
    const CalibrationPoint& point = points[static_cast<std::size_t>(std::min(i, n - 1))];
    const Eigen::Matrix2d information =
        i < n ? Eigen::Matrix2d(point.covariance_px2.inverse()) : Eigen::Matrix2d(Eigen::Matrix2d::Zero());
    columns.x_mm(i) = point.p_W_mm.x();
    columns.y_mm(i) = point.p_W_mm.y();
    columns.z_mm(i) = point.p_W_mm.z();
    columns.u_px(i) = point.u_px.x();
    columns.v_px(i) = point.u_px.y();
    columns.wuu(i) = information(0, 0);
    columns.wuv(i) = information(0, 1);
    columns.wvv(i) = information(1, 1);
  }
  columns.correlated = n > 0 && columns.wuv.abs().maxCoeff() > 0;
  return columns;
}

Eigen::Index lens_size(const CameraModel& camera) {
  return std::holds_alternative<Division>(camera.distortion) ? 1 : 5;
}

ViewEquations normal_equations(const PointColumns& points, const CameraModel& camera, const Pose& X_WC,
                               const Objective& objective) {
  const Eigen::Index size = 10 + lens_size(camera);
  ViewEquations sum;
  sum.N.setZero(size, size);
  sum.g.setZero(size);
  const Eigen::Index n = points.x_mm.size();
  for (Eigen::Index first = 0; first < n; first += block)
    if (!add_block(points, first, camera, X_WC, objective, sum)) return sum;
  sum.N.triangularView<Eigen::StrictlyUpper>() = sum.N.transpose();
  sum.visible = std::isfinite(sum.cost) && sum.g.allFinite();
  return sum;
}

}  // namespace zeropose
