#include "measure/reliability.h"

#include <Eigen/LU>
#include <algorithm>
#include <map>
#include <optional>

#include "calib/symmetric_eigen.h"

namespace zeropose {
namespace {

using Eigen::Matrix2d;
using Eigen::Matrix3d;
using Eigen::Vector3d;
using Matrix23 = Eigen::Matrix<double, 2, 3>;
using Matrix26 = Eigen::Matrix<double, 2, 6>;
using Matrix62 = Eigen::Matrix<double, 6, 2>;

constexpr double infinite = std::numeric_limits<double>::infinity();
// Of the normal distribution: exceeded with a chance of 1 %.
constexpr double missed_detection = 2.326347874040841;
// Below this share of an error in its own deviation nothing checks an observation.
constexpr double least_redundancy = 1e-6;
// Of the best checked direction of an error: one that is checked less is not checked.
constexpr double least_share = 1e-12;

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
double largest_stretch(const Eigen::MatrixXd& A) {
  return std::sqrt(std::max(0.0, symmetric_eigen(A.transpose() * A).values.maxCoeff()));
}

// An error b of k numbers: what it does to the pose and to the deviations that show it.
template <int k>
struct Fault {
  using Square = Eigen::Matrix<double, k, k>;
  Eigen::Matrix<double, 6, k> gain = Eigen::Matrix<double, 6, k>::Zero();  // delta by b
  Square M = Square::Zero();  // b' M b: the sum of the non-centralities of those deviations
  int deviations = 0;
};

// `by_fault`: the derivative of each row's pixel by b.
template <int k>
Fault<k> fault_of(std::span<const Row* const> rows, const Estimator& estimator,
                  const std::vector<Eigen::Matrix<double, 2, k>>& by_fault) {
  Fault<k> fault;
  for (std::size_t i = 0; i < rows.size(); ++i)
    fault.gain += estimator.inverse_N * rows[i]->J.transpose() * rows[i]->P * by_fault[i];
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const Row& row = *rows[i];
    const Matrix2d H = row.J * estimator.inverse_N * row.J.transpose() * row.P;
    const Matrix2d Q =
        row.T - H * row.T - row.T * H.transpose() + row.J * estimator.covariance * row.J.transpose();
    const Eigen::Matrix<double, 2, k> shown = by_fault[i] - row.J * fault.gain;
    // What nothing checks has neither a deviation nor a variance of it.
    if (std::abs((Matrix2d::Identity() - H).determinant()) > least_redundancy)
      fault.M += shown.transpose() * Q.inverse() * shown;
    ++fault.deviations;
  }
  return fault;
}

struct Hidden {
  double detectable = infinite, error_mm = infinite;
  std::size_t worst_point = 0;
};

template <int k>
Hidden hidden_by(const Fault<k>& fault, double noncentrality, std::span<const Vector3d> arms_W_mm) {
  Hidden hidden;
  if (!fault.M.allFinite()) return hidden;
  const SymmetricEigen eigen = symmetric_eigen(fault.M);
  if (!(eigen.values(0) > least_share * eigen.values(k - 1))) return hidden;
  // Below the sum of what each deviation may hide none of them is sure to be beyond its own.
  const double largest = noncentrality * std::sqrt(fault.deviations);
  const Eigen::MatrixXd L = largest * eigen.vectors * eigen.values.cwiseSqrt().cwiseInverse().asDiagonal();
  const Eigen::MatrixXd delta = fault.gain * L;
  hidden = {largest_stretch(L), 0, 0};
  for (std::size_t i = 0; i < arms_W_mm.size(); ++i) {
    const double error_mm =
        largest_stretch(delta.topRows<3>() - cross_matrix(arms_W_mm[i]) * delta.bottomRows<3>());
    if (!(error_mm <= hidden.error_mm)) hidden.error_mm = error_mm, hidden.worst_point = i;
  }
  return hidden;
}

ObservationReliability judge(const Row& row, const Estimator& estimator, double noncentrality,
                             std::span<const Vector3d> arms_W_mm) {
  const Row* const rows[] = {&row};
  const Hidden hidden =
      hidden_by(fault_of<2>(rows, estimator, {Matrix2d::Identity()}), noncentrality, arms_W_mm);
  const double own_share = (row.J * estimator.inverse_N * row.J.transpose() * row.P).trace();
  return {row.observation, 1 - 0.5 * own_share, hidden.detectable, hidden.error_mm, hidden.worst_point};
}

// Marks that several of the rows show.
std::vector<MarkReliability> judge_marks(const PoseProblem& problem, const std::vector<Row>& rows,
                                         const Estimator& estimator, double noncentrality,
                                         std::span<const Vector3d> arms_W_mm) {
  std::map<std::size_t, std::vector<const Row*>> by_mark;
  for (const Row& row : rows) by_mark[problem.observations[row.observation].mark].push_back(&row);
  std::vector<MarkReliability> marks;
  for (const auto& [mark, shown_by] : by_mark) {
    if (shown_by.size() < 2) continue;
    std::vector<Matrix23> by_place;
    for (const Row* row : shown_by) by_place.emplace_back(row->J.leftCols<3>());
    const Hidden hidden = hidden_by(fault_of<3>(shown_by, estimator, by_place), noncentrality, arms_W_mm);
    marks.push_back({mark, hidden.detectable, hidden.error_mm, hidden.worst_point});
  }
  return marks;
}

void find_worst(Reliability& reliability) {
  for (std::size_t i = 0; i < reliability.observations.size(); ++i)
    if (!(reliability.observations[i].hidden_mm <= reliability.hidden_mm)) {
      reliability.hidden_mm = reliability.observations[i].hidden_mm;
      reliability.worst = i;
    }
  for (std::size_t i = 0; i < reliability.marks.size(); ++i)
    if (!(reliability.marks[i].hidden_mm <= reliability.hidden_mm)) {
      reliability.hidden_mm = reliability.marks[i].hidden_mm;
      reliability.worst_is_mark = true;
      reliability.worst = i;
    }
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
  for (const Row& row : rows) result.observations.push_back(judge(row, estimator, noncentrality, arms_W_mm));
  result.marks = judge_marks(problem, rows, estimator, noncentrality, arms_W_mm);
  find_worst(result);
  return result;
}

}  // namespace zeropose
