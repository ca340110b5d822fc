#include "calib/symmetric_eigen.h"

#include <Eigen/Eigenvalues>
#include <limits>

namespace zeropose {

SymmetricEigen symmetric_eigen(const Eigen::MatrixXd& M) {
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(M);
  if (solver.info() == Eigen::Success) return {solver.eigenvalues(), solver.eigenvectors()};
  const double nothing = std::numeric_limits<double>::quiet_NaN();
  return {Eigen::VectorXd::Constant(M.rows(), nothing),
          Eigen::MatrixXd::Constant(M.rows(), M.cols(), nothing)};
}

}  // namespace zeropose
