// Eigenvalues of symmetric matrices for code that is not in a hurry: the library's templates take seconds to
// compile, here they are compiled once for all.
#pragma once

#include <Eigen/Core>

namespace zeropose {

struct SymmetricEigen {
  Eigen::VectorXd values;   // ascending
  Eigen::MatrixXd vectors;  // the unit vectors that belong to them, column by column
};

// Reads the lower triangle of M, n x n. Numbers that are not finite give results that are not; all are NaN
// where the iteration does not end.
SymmetricEigen symmetric_eigen(const Eigen::MatrixXd& M);

}  // namespace zeropose
