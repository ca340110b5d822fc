#include "calib/linear_parts.h"

#include <Eigen/SVD>
#include <cmath>
#include <limits>

#include "calib/words.h"

namespace zeropose::linear {

using Eigen::MatrixXd;
using Eigen::VectorXd;

// Through the triangular factor, which has the same singular values: A may have many rows.
NullVector null_vector(const MatrixXd& A) {
  const Eigen::Index n = A.cols();
  const Eigen::HouseholderQR<MatrixXd> qr(A);
  MatrixXd R = MatrixXd::Zero(n, n);
  const Eigen::Index rows = std::min(n, A.rows());
  R.topRows(rows) = qr.matrixQR().topRows(rows).template triangularView<Eigen::Upper>();
  const Eigen::JacobiSVD<MatrixXd> svd(R, Eigen::ComputeFullV);
  NullVector result;
  result.x = svd.matrixV().col(n - 1);
  const double last_but_one = svd.singularValues()(n - 2);
  result.condition =
      last_but_one > 0 ? svd.singularValues()(0) / last_but_one : std::numeric_limits<double>::infinity();
  return result;
}

LeastSquares least_squares(const MatrixXd& A, const VectorXd& b) {
  LeastSquares result;
  const Eigen::Index n = A.cols();
  const VectorXd size = A.colwise().norm().cwiseMax(std::numeric_limits<double>::min());
  const MatrixXd scaled = A * size.cwiseInverse().asDiagonal();
  const Eigen::HouseholderQR<MatrixXd> qr(scaled);
  const MatrixXd R = MatrixXd(qr.matrixQR().topRows(n)).triangularView<Eigen::Upper>();
  const Eigen::JacobiSVD<MatrixXd> svd(R, Eigen::ComputeFullU | Eigen::ComputeFullV);
  const VectorXd& values = svd.singularValues();
  result.condition = values(n - 1) > 0 ? values(0) / values(n - 1) : std::numeric_limits<double>::infinity();
  const VectorXd x = svd.solve(VectorXd((qr.householderQ().transpose() * b).head(n)));
  result.x = x.cwiseQuotient(size);
  const double freedom = std::max<double>(1, static_cast<double>(A.rows() - n));
  const double variance = (scaled * x - b).squaredNorm() / freedom;
  const MatrixXd spread = svd.matrixV() * values.cwiseInverse().asDiagonal();
  result.sigma = (spread.rowwise().norm() * std::sqrt(variance)).cwiseQuotient(size);
  return result;
}

Centred centred(std::span<const CalibrationPoint> points) {
  Centred result;
  for (const CalibrationPoint& point : points) result.centroid_mm += point.p_W_mm;
  result.centroid_mm /= static_cast<double>(points.size());
  for (const CalibrationPoint& point : points) result.p_mm.push_back(point.p_W_mm - result.centroid_mm);
  return result;
}

bool all_in_front(std::span<const CalibrationPoint> points, const Pose& X_WC) {
  const Pose X_CW = X_WC.inverse();
  for (const CalibrationPoint& point : points)
    if (!((X_CW * point.p_W_mm).z() > 0)) return false;
  return true;
}

LinearResult failure(CalibrationStatus status, std::string reason, double condition) {
  LinearResult result;
  result.status = status;
  result.reason = std::move(reason);
  result.condition = condition;
  return result;
}

Pose pose_from(const Eigen::Matrix3d& R_CW, const Eigen::Vector3d& t_C, const Eigen::Vector3d& centroid) {
  Pose X_WC = Pose::Identity();
  X_WC.linear() = R_CW.transpose();
  X_WC.translation() = centroid - R_CW.transpose() * t_C;
  return X_WC;
}

}  // namespace zeropose::linear
