#include "calib/symmetric_eigen.h"

#include <Eigen/Eigenvalues>

namespace zeropose {

SymmetricEigen symmetric_eigen(const Eigen::MatrixXd& M) {
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(M);
  return {solver.eigenvalues(), solver.eigenvectors()};
}

}  // namespace zeropose
