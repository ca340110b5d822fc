// Cholesky factor of a small symmetric matrix, for the pose's inner loop: several times faster than the
// general one at this size. Internal to the room.
#pragma once

#include <Eigen/Core>
#include <cmath>

namespace zeropose {

template <int n>
class SmallCholesky {
 public:
  using Matrix = Eigen::Matrix<double, n, n>;
  using Vector = Eigen::Matrix<double, n, 1>;

  // Reads the lower triangle. ok() is false when M is not positive definite.
  explicit SmallCholesky(const Matrix& M) {
    for (int j = 0; j < n; ++j) {
      double pivot = M(j, j);
      for (int k = 0; k < j; ++k) pivot -= L_(j, k) * L_(j, k);
      if (!(pivot > 0)) return;
      const double root = std::sqrt(pivot);
      L_(j, j) = root;
      inverse_diagonal_(j) = 1 / root;
      for (int i = j + 1; i < n; ++i) {
        double sum = M(i, j);
        for (int k = 0; k < j; ++k) sum -= L_(i, k) * L_(j, k);
        L_(i, j) = sum * inverse_diagonal_(j);
      }
    }
    ok_ = true;
  }

  bool ok() const { return ok_; }

  // A lower bound of the condition number.
  double condition_at_least() const {
    const double ratio = L_.diagonal().maxCoeff() / L_.diagonal().minCoeff();
    return ratio * ratio;
  }

  // L^-1 b.
  Vector forward(Vector b) const {
    for (int i = 0; i < n; ++i) {
      for (int k = 0; k < i; ++k) b(i) -= L_(i, k) * b(k);
      b(i) *= inverse_diagonal_(i);
    }
    return b;
  }

  Vector solve(Vector b) const {
    b = forward(b);
    for (int i = n - 1; i >= 0; --i) {
      for (int k = i + 1; k < n; ++k) b(i) -= L_(k, i) * b(k);
      b(i) *= inverse_diagonal_(i);
    }
    return b;
  }

  // L^-T L^-1, symmetric to the last bit.
  Matrix inverse() const {
    Matrix K = Matrix::Zero();  // L^-1
    for (int j = 0; j < n; ++j) {
      K(j, j) = inverse_diagonal_(j);
      for (int i = j + 1; i < n; ++i) {
        double sum = 0;
        for (int k = j; k < i; ++k) sum -= L_(i, k) * K(k, j);
        K(i, j) = sum * inverse_diagonal_(i);
      }
    }
    Matrix inverse;
    for (int j = 0; j < n; ++j)
      for (int i = j; i < n; ++i) {
        double sum = 0;
        for (int k = i; k < n; ++k) sum += K(k, i) * K(k, j);
        inverse(i, j) = inverse(j, i) = sum;
      }
    return inverse;
  }

 private:
  Matrix L_ = Matrix::Zero();
  Vector inverse_diagonal_ = Vector::Zero();
  bool ok_ = false;
};

// Of M by its inverse, in the 1-norm.
template <typename Matrix>
double condition_of(const Matrix& M, const Matrix& inverse) {
  return M.cwiseAbs().colwise().sum().maxCoeff() * inverse.cwiseAbs().colwise().sum().maxCoeff();
}

}  // namespace zeropose
