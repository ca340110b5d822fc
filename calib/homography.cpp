#include "calib/homography.h"

#include <cmath>

#include "calib/symmetric_eigen.h"

namespace zeropose {
namespace {

using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector2d;
using Eigen::Vector3d;
using Eigen::VectorXd;
using Matrix34 = Eigen::Matrix<double, 3, 4>;

// Shift to the mean, scale to a mean distance of one: n = (p - mean) * scale.
template <int size>
struct Normaliser {
  Eigen::Matrix<double, size, 1> mean = Eigen::Matrix<double, size, 1>::Zero();
  double scale = 0;

  template <typename Get>
  Normaliser(std::span<const ImagedPoint> pairs, const Get& get) {
    const double count = static_cast<double>(pairs.size());
    for (const ImagedPoint& pair : pairs) mean += get(pair) / count;
    double distance = 0;
    for (const ImagedPoint& pair : pairs) distance += (get(pair) - mean).norm() / count;
    if (distance > 0) scale = 1 / distance;
  }
  Eigen::Matrix<double, size, 1> operator()(const Eigen::Matrix<double, size, 1>& p) const {
    return (p - mean) * scale;
  }
  Eigen::Matrix<double, size + 1, size + 1> matrix() const {
    Eigen::Matrix<double, size + 1, size + 1> T = Eigen::Matrix<double, size + 1, size + 1>::Identity();
    T.template topLeftCorner<size, size>() *= scale;
    T.template topRightCorner<size, 1>() = -scale * mean;
    return T;
  }
};

Vector2d plane_of(const ImagedPoint& pair) { return pair.p_mm.head<2>(); }
Vector2d pixel_of(const ImagedPoint& pair) { return pair.u; }
Vector3d space_of(const ImagedPoint& pair) { return pair.p_mm; }

// Sums over points x (homogeneous) seen at u: A^T A of the direct linear transform, whose rows are
// (x 0 -ux x) and (0 x -uy x), in blocks.
template <int n>
struct Sums {
  using Block = Eigen::Matrix<double, n, n>;
  Block xx = Block::Zero(), uxx = Block::Zero(), vxx = Block::Zero(), qxx = Block::Zero();

  void add(const Eigen::Matrix<double, n, 1>& x, const Vector2d& u) {
    const Block product = x * x.transpose();
    xx += product;
    uxx += u.x() * product;
    vxx += u.y() * product;
    qxx += u.squaredNorm() * product;
  }
  MatrixXd lower() const {
    MatrixXd sums = MatrixXd::Zero(3 * n, 3 * n);
    sums.block(0, 0, n, n) = sums.block(n, n, n, n) = xx;
    sums.block(2 * n, 0, n, n) = -uxx;
    sums.block(2 * n, n, n, n) = -vxx;
    sums.block(2 * n, 2 * n, n, n) = qxx;
    return sums;
  }
};

// The direction in which nearly nothing is seen, or nothing if there are two such.
std::optional<VectorXd> null_vector(const MatrixXd& lower) {
  const SymmetricEigen eigen = symmetric_eigen(lower);
  if (!(eigen.values[1] > 1e-9 * eigen.values[eigen.values.size() - 1])) return std::nullopt;
  return eigen.vectors.col(0);
}

}  // namespace

std::optional<Matrix3d> homography(std::span<const ImagedPoint> pairs) {
  if (pairs.size() < 4) return std::nullopt;
  const Normaliser<2> from(pairs, plane_of), to(pairs, pixel_of);
  if (from.scale == 0 || to.scale == 0) return std::nullopt;
  Sums<3> sums;
  for (const ImagedPoint& pair : pairs) sums.add(from(plane_of(pair)).homogeneous(), to(pixel_of(pair)));
  const auto h = null_vector(sums.lower());
  if (!h) return std::nullopt;
  Matrix3d H;
  H << h->segment<3>(0).transpose(), h->segment<3>(3).transpose(), h->segment<3>(6).transpose();
  if (std::abs(H.determinant()) < 1e-9 * std::pow(H.norm(), 3)) return std::nullopt;
  // The inverse of the normaliser, written out: u = n / scale + mean.
  Matrix3d back = Matrix3d::Identity();
  back.topLeftCorner<2, 2>() /= to.scale;
  back.topRightCorner<2, 1>() = to.mean;
  return back * H * from.matrix();
}

std::optional<Pose> pose_of_plane(const Matrix3d& H, std::span<const ImagedPoint> pairs) {
  const double scale = 2 / (H.col(0).norm() + H.col(1).norm());
  const double sign = H.row(2).dot(plane_of(pairs.front()).homogeneous()) > 0 ? 1 : -1;
  const Matrix3d M = sign * scale * H;
  for (const ImagedPoint& pair : pairs)
    if (!(M.row(2).dot(plane_of(pair).homogeneous()) > 0)) return std::nullopt;
  Matrix3d R;
  R << M.col(0), M.col(1), M.col(0).cross(M.col(1));
  Pose X_CB = Pose::Identity();
  X_CB.linear() = nearest_rotation(R);
  X_CB.translation() = M.col(2);
  if (!X_CB.matrix().allFinite()) return std::nullopt;
  return X_CB;
}

std::optional<Matrix34> projection_matrix(std::span<const ImagedPoint> pairs) {
  if (pairs.size() < 6) return std::nullopt;
  const Normaliser<3> from(pairs, space_of);
  const Normaliser<2> to(pairs, pixel_of);
  if (from.scale == 0 || to.scale == 0) return std::nullopt;
  Sums<4> sums;
  for (const ImagedPoint& pair : pairs) sums.add(from(space_of(pair)).homogeneous(), to(pixel_of(pair)));
  const auto h = null_vector(sums.lower());
  if (!h) return std::nullopt;
  Matrix34 P;
  P << h->segment<4>(0).transpose(), h->segment<4>(4).transpose(), h->segment<4>(8).transpose();
  Matrix3d back = Matrix3d::Identity();
  back.topLeftCorner<2, 2>() /= to.scale;
  back.topRightCorner<2, 1>() = to.mean;
  return back * P * from.matrix();
}

std::optional<Pose> pose_of_projection(const Matrix34& P, std::span<const ImagedPoint> pairs) {
  const double sign = P.row(2).dot(pairs.front().p_mm.homogeneous()) > 0 ? 1 : -1;
  for (const ImagedPoint& pair : pairs)
    if (!(sign * P.row(2).dot(pair.p_mm.homogeneous()) > 0)) return std::nullopt;
  const Matrix3d M = sign * P.leftCols<3>();
  const double volume = M.determinant();
  if (!(volume > 0)) return std::nullopt;
  Pose X_CB = Pose::Identity();
  X_CB.linear() = nearest_rotation(M);
  X_CB.translation() = sign * P.col(3) / std::cbrt(volume);
  return X_CB;
}

std::optional<double> focal_of_planes(std::span<const Matrix3d> homographies) {
  // With w = 1/f^2: (h1 . h2) w = -h31 h32 and (h1^2 - h2^2) w = h32^2 - h31^2 over the first two rows.
  double ww = 0, wr = 0, rr = 0;
  for (const Matrix3d& H0 : homographies) {
    const Matrix3d H = H0 / std::sqrt(H0.col(0).norm() * H0.col(1).norm());
    const Vector2d a = H.col(0).head<2>(), b = H.col(1).head<2>();
    const double left[2] = {a.dot(b), a.squaredNorm() - b.squaredNorm()};
    const double right[2] = {-H(2, 0) * H(2, 1), H(2, 1) * H(2, 1) - H(2, 0) * H(2, 0)};
    for (int k = 0; k < 2; ++k) ww += left[k] * left[k], wr += left[k] * right[k], rr += right[k] * right[k];
  }
  const double w = wr / ww;
  if (!(w > 0) || !std::isfinite(w) || !(rr > 0)) return std::nullopt;
  return 1 / std::sqrt(w);
}

std::optional<double> focal_of_projection(const Matrix34& P) {
  // P = diag(f, f, 1) [R t] up to a factor: |row 1| |row 2| = f^2 |row 3|^2.
  const double third = P.row(2).head<3>().norm();
  const Vector3d axis = P.row(2).head<3>().transpose() / third;
  const auto across = [&](int row) {
    const Vector3d r = P.row(row).head<3>().transpose();
    return (r - r.dot(axis) * axis).norm() / third;
  };
  const double f = std::sqrt(across(0) * across(1));
  if (!(f > 0) || !std::isfinite(f)) return std::nullopt;
  return f;
}

}  // namespace zeropose
