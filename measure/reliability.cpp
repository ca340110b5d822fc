#include "measure/reliability.h"

#include <Eigen/LU>
#include <algorithm>
#include <optional>

#include "measure/small_cholesky.h"

namespace zeropose {
namespace {

using Eigen::Matrix2d;
using Eigen::Matrix3d;
using Eigen::Vector3d;
using Matrix23 = Eigen::Matrix<double, 2, 3>;
using Matrix26 = Eigen::Matrix<double, 2, 6>;
using Matrix62 = Eigen::Matrix<double, 6, 2>;

// Of the normal distribution: exceeded with a chance of 1 %.
constexpr double missed_detection = 2.326347874040841;
// Below this share of an error in its own deviation nothing checks an observation.
constexpr double least_redundancy = 1e-6;

// An observation at the estimated pose. The delta is that of moved() with the rotation about M, the middle of
// the marks.
struct Row {
  std::size_t observation = 0;
  Matrix26 J;  // derivative of the pixel by delta
  Matrix2d P;  // weight: what the estimate took as its information
  Matrix2d T;  // total covariance, px^2
};

Vector3d middle_of(const PoseProblem& problem, const PoseResult& pose) {
  Vector3d sum = Vector3d::Zero();
  double count = 0;
  for (std::size_t i = 0; i < pose.deviations.size(); ++i) {
    if (!pose.deviations[i].used) continue;
    sum += problem.marks[problem.observations[i].mark].p_O_mm;
    ++count;
  }
  return sum / std::max(1.0, count);
}

std::optional<Row> row_of(const PoseProblem& problem, std::size_t i, const Pose& X_WO,
                          const Vector3d& middle_O_mm) {
  const Observation& observation = problem.observations[i];
  const CalibratedCamera& camera = problem.cameras[observation.camera];
  const Mark& mark = problem.marks[observation.mark];
  const auto projection = project_with_jacobian(camera.model, camera.X_WC.inverse() * (X_WO * mark.p_O_mm));
  if (!projection) return std::nullopt;
  const Matrix23 A = projection->du_dp * camera.X_WC.linear().transpose();
  Row row;
  row.observation = i;
  row.J << A, -A * cross_matrix(X_WO.linear() * (mark.p_O_mm - middle_O_mm));
  row.P = mark.weight * mark.weight * observation.covariance_px2.inverse();
  row.T = observation.covariance_px2 + mark.sigma_mm * mark.sigma_mm * A * A.transpose();
  row.T.diagonal().array() += problem.system_sigma_px * problem.system_sigma_px;
  return row;
}

std::vector<Row> rows_of(const PoseProblem& problem, const PoseResult& pose, const Vector3d& middle_O_mm) {
  std::vector<Row> rows;
  for (std::size_t i = 0; i < pose.deviations.size(); ++i)
    if (pose.deviations[i].used)
      if (const auto row = row_of(problem, i, pose.X_WO, middle_O_mm)) rows.push_back(*row);
  return rows;
}

// The directions in which the object may move: all, or those of its plane.
Eigen::Matrix<double, 6, Eigen::Dynamic> free_directions(const PoseProblem& problem) {
  if (!problem.X_WP_planar) return Matrix6::Identity();
  const Matrix3d R_WP = problem.X_WP_planar->linear();
  Eigen::Matrix<double, 6, Eigen::Dynamic> basis = Eigen::Matrix<double, 6, 3>::Zero();
  basis.topLeftCorner<3, 2>() = R_WP.leftCols<2>();
  basis.bottomRightCorner<3, 1>() = R_WP.col(2);
  return basis;
}

struct Estimator {
  Matrix6 inverse_N, covariance;
};

Estimator estimator_of(const PoseProblem& problem, const std::vector<Row>& rows) {
  Matrix6 N = Matrix6::Zero(), total = Matrix6::Zero();
  for (const Row& row : rows) {
    const Matrix62 JP = row.J.transpose() * row.P;
    N += JP * row.J;
    total += JP * row.T * JP.transpose();
  }
  const auto basis = free_directions(problem);
  const Matrix6 inverse_N = basis * (basis.transpose() * N * basis).inverse() * basis.transpose();
  return {inverse_N, inverse_N * total * inverse_N};
}

// The largest length of A b over all b with b' b = 1.
double largest_stretch(const Eigen::Matrix<double, 3, 2>& A) {
  const Matrix2d S = A.transpose() * A;
  const double half_trace = 0.5 * S.trace();
  return std::sqrt(half_trace + std::sqrt(std::max(0.0, half_trace * half_trace - S.determinant())));
}

ObservationReliability judge(const Row& row, const Estimator& estimator, double noncentrality,
                             std::span<const Vector3d> arms_W_mm) {
  constexpr double infinite = std::numeric_limits<double>::infinity();
  ObservationReliability result{row.observation, 0, infinite, infinite, 0};
  const Matrix62 gain = estimator.inverse_N * row.J.transpose() * row.P;  // delta by an error of the pixel
  const Matrix2d H = row.J * gain;
  const Matrix2d shown = Matrix2d::Identity() - H;
  result.redundancy = 0.5 * shown.trace();
  const Matrix2d Q =
      row.T - H * row.T - row.T * H.transpose() + row.J * estimator.covariance * row.J.transpose();
  // b' M b is the non-centrality of its normalised deviation when its pixel is off by b.
  const Matrix2d M = shown.transpose() * Q.inverse() * shown;
  const SmallCholesky<2> cholesky(M);
  if (!(std::abs(shown.determinant()) > least_redundancy) || !M.allFinite() || !cholesky.ok()) return result;
  const Matrix2d inverse_M = cholesky.inverse();
  const double l11 = std::sqrt(inverse_M(0, 0)), l21 = inverse_M(1, 0) / l11;
  Matrix2d L;
  L << l11, 0, l21, std::sqrt(std::max(0.0, inverse_M(1, 1) - l21 * l21));
  Eigen::Matrix<double, 3, 2> flat = Eigen::Matrix<double, 3, 2>::Zero();
  flat.topRows<2>() = L;
  result.detectable_px = noncentrality * largest_stretch(flat);
  result.hidden_mm = 0;
  for (std::size_t k = 0; k < arms_W_mm.size(); ++k) {
    const Matrix62 by_unit = gain * L;
    const double error_mm =
        noncentrality *
        largest_stretch(by_unit.topRows<3>() - cross_matrix(arms_W_mm[k]) * by_unit.bottomRows<3>());
    if (!(error_mm <= result.hidden_mm)) result.hidden_mm = error_mm, result.worst_point = k;
  }
  return result;
}

}  // namespace

Reliability reliability_of(const PoseProblem& problem, const PoseResult& pose,
                           std::span<const Vector3d> points_O_mm) {
  Reliability result;
  if (pose.code != Code::ok) return result;
  const Vector3d middle_O_mm = middle_of(problem, pose);
  const std::vector<Row> rows = rows_of(problem, pose, middle_O_mm);
  std::vector<Vector3d> arms_W_mm;
  for (const Vector3d& p_O : points_O_mm) arms_W_mm.push_back(pose.X_WO.linear() * (p_O - middle_O_mm));
  if (arms_W_mm.empty())
    for (const Row& row : rows)
      arms_W_mm.push_back(pose.X_WO.linear() *
                          (problem.marks[problem.observations[row.observation].mark].p_O_mm - middle_O_mm));
  const Estimator estimator = estimator_of(problem, rows);
  const double noncentrality = critical_deviation(rows.size()) + missed_detection;
  for (const Row& row : rows) {
    result.observations.push_back(judge(row, estimator, noncentrality, arms_W_mm));
    if (result.observations.back().hidden_mm <= result.hidden_mm) continue;
    result.hidden_mm = result.observations.back().hidden_mm;
    result.worst = result.observations.size() - 1;
  }
  return result;
}

}  // namespace zeropose
