#include "measure/pose_deletion.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <memory>

#include "measure/small_cholesky.h"

namespace zeropose {
namespace {

using Rows = Eigen::Matrix<double, Eigen::Dynamic, 6, Eigen::RowMajor>;
using Matrix6x2 = Eigen::Matrix<double, 6, 2>;

// Below this share of its variance an observation is not controlled by the others.
constexpr double least_redundancy = 1e-9;

// The unknowns of a model: a planar one has three, the others stay zero.
Matrix6 basis_of(const PoseModel& model) {
  if (!model.planar()) return Matrix6::Identity();
  Matrix6 basis = Matrix6::Zero();
  basis.leftCols<3>() = model.planar_basis();
  return basis;
}

// Unknowns that a planar problem does not have stay zero.
void fix_the_unused(const Matrix6& basis, Matrix6& N) {
  for (Eigen::Index i = 0; i < 6; ++i)
    if (basis.col(i).isZero()) N(i, i) = 1;
}

// One observation, whitened by its total covariance.
struct Equation {
  Eigen::Matrix<double, 2, 6> J;
  Eigen::Vector2d r;
  double doubt;

  Equation(const PoseModel& model, std::size_t i, const Matrix6& basis)
      : J(model.planar() ? model.WJ(i) * basis : model.WJ(i)), r(model.Wr(i)) {
    const Eigen::Matrix2d C = model.total_covariance(i);
    const double l11 = std::sqrt(C(0, 0)), l21 = C(1, 0) / l11, l22 = std::sqrt(C(1, 1) - l21 * l21);
    J.row(0) /= l11;
    r[0] /= l11;
    J.row(1) = (J.row(1) - l21 * J.row(0)) / l22;
    r[1] = (r[1] - l21 * r[0]) / l22;
    doubt = 2 * r.norm() * model.dev_px(i).norm() / model.camera(i).model.fx_px;
  }
};

// Leaves out observation after observation: each is a block of two rows and columns of the redundancy matrix
// Q = I - J N^-1 J', and Schur's complement without it is the matrix of the others.
class SetSearch {
 public:
  SetSearch(const Rows& Y, const Eigen::VectorXd& r, std::size_t k, double highest)
      : n_(static_cast<std::size_t>(r.size()) / 2), width_(2 * n_), k_(k), highest_(highest) {
    if (k == 1) {
      look_at_each(Y, r);
      return;
    }
    for (std::size_t level = 0; level + 1 < k; ++level)
      levels_.push_back({std::make_unique_for_overwrite<double[]>(width_ * width_),
                         std::make_unique_for_overwrite<double[]>(width_)});
    Level& all = levels_[0];
    for (std::size_t i = 0; i < width_; ++i) {
      const auto row = static_cast<Eigen::Index>(i);
      all.r[i] = r[row];
      for (std::size_t j = 0; j <= i; ++j)
        all.Q[j * width_ + i] = (i == j ? 1 : 0) - Y.row(row).dot(Y.row(static_cast<Eigen::Index>(j)));
    }
    descend(0, 0, r.squaredNorm());
  }

  struct Hit {
    double misfit;
    std::uint64_t set;
  };
  std::vector<Hit> hits;

 private:
  struct Level {
    std::unique_ptr<double[]> Q, r;  // Q: upper triangle
  };

  // Inverse of a block of two.
  struct Inverse {
    double i11, i12, i22;
    bool ok;

    Inverse(double q11, double q12, double q22) {
      const double determinant = q11 * q22 - q12 * q12;
      ok = determinant > least_redundancy * least_redundancy && q11 > least_redundancy &&
           determinant > least_redundancy * q11;
      i11 = q22 / determinant, i12 = -q12 / determinant, i22 = q11 / determinant;
    }
    double square(double a, double b) const { return i11 * a * a + 2 * i12 * a * b + i22 * b * b; }
  };

  void look_at_each(const Rows& Y, const Eigen::VectorXd& r) {
    const double misfit = r.squaredNorm();
    for (std::size_t i = 0; i < n_; ++i) {
      const auto row = static_cast<Eigen::Index>(2 * i);
      const Inverse inverse(1 - Y.row(row).squaredNorm(), -Y.row(row).dot(Y.row(row + 1)),
                            1 - Y.row(row + 1).squaredNorm());
      set_ = std::uint64_t{1} << i;
      if (inverse.ok) record(misfit - inverse.square(r[row], r[row + 1]));
    }
  }

  void record(double misfit) {
    if (misfit <= highest_) hits.push_back({misfit, set_});
  }

  void descend(std::size_t depth, std::size_t first, double misfit) {
    const Level& level = levels_[depth];
    const std::size_t missing = k_ - depth;
    for (std::size_t i = first; i + missing <= n_; ++i) {
      const double* row1 = &level.Q[2 * i * width_];
      const double* row2 = row1 + width_;
      const Inverse inverse(row1[2 * i], row1[2 * i + 1], row2[2 * i + 1]);
      if (!inverse.ok) continue;
      const double r1 = level.r[2 * i], r2 = level.r[2 * i + 1];
      const double rest = misfit - inverse.square(r1, r2);
      set_ |= std::uint64_t{1} << i;
      if (missing == 2)
        last_of_pair(level, i, inverse, rest);
      else
        go_on(depth, i, inverse, rest);
      set_ &= ~(std::uint64_t{1} << i);
    }
  }

  // Only the blocks on the diagonal matter for the last one.
  void last_of_pair(const Level& level, std::size_t i, const Inverse& inverse, double misfit) {
    const double* row1 = &level.Q[2 * i * width_];
    const double* row2 = row1 + width_;
    const double r1 = level.r[2 * i], r2 = level.r[2 * i + 1];
    for (std::size_t j = i + 1; j < n_; ++j) {
      const double a1 = row1[2 * j], b1 = row1[2 * j + 1], a2 = row2[2 * j], b2 = row2[2 * j + 1];
      const double ta1 = inverse.i11 * a1 + inverse.i12 * a2, ta2 = inverse.i12 * a1 + inverse.i22 * a2;
      const double tb1 = inverse.i11 * b1 + inverse.i12 * b2, tb2 = inverse.i12 * b1 + inverse.i22 * b2;
      const double* own1 = &level.Q[2 * j * width_];
      const double* own2 = own1 + width_;
      const Inverse last(own1[2 * j] - a1 * ta1 - a2 * ta2, own1[2 * j + 1] - b1 * ta1 - b2 * ta2,
                         own2[2 * j + 1] - b1 * tb1 - b2 * tb2);
      if (!last.ok) continue;
      set_ |= std::uint64_t{1} << j;
      record(misfit -
             last.square(level.r[2 * j] - ta1 * r1 - ta2 * r2, level.r[2 * j + 1] - tb1 * r1 - tb2 * r2));
      set_ &= ~(std::uint64_t{1} << j);
    }
  }

  void go_on(std::size_t depth, std::size_t i, const Inverse& inverse, double misfit) {
    const Level& level = levels_[depth];
    Level& next = levels_[depth + 1];
    const double* row1 = &level.Q[2 * i * width_];
    const double* row2 = row1 + width_;
    const double r1 = level.r[2 * i], r2 = level.r[2 * i + 1];
    for (std::size_t j = 2 * i + 2; j < width_; ++j) {
      const double t1 = inverse.i11 * row1[j] + inverse.i12 * row2[j];
      const double t2 = inverse.i12 * row1[j] + inverse.i22 * row2[j];
      next.r[j] = level.r[j] - t1 * r1 - t2 * r2;
      const double* from = &level.Q[j * width_];
      double* to = &next.Q[j * width_];
      for (std::size_t l = j; l < width_; ++l) to[l] = from[l] - t1 * row1[l] - t2 * row2[l];
    }
    descend(depth + 1, i + 1, misfit);
  }

  std::size_t n_, width_, k_;
  double highest_;
  std::vector<Level> levels_;
  std::uint64_t set_ = 0;
};

}  // namespace

LinearFit::LinearFit(const PoseModel& model) : basis_(basis_of(model)), extent_mm_(model.extent_mm()) {
  for (std::size_t i = 0; i < model.size(); ++i)
    if (model.active(i)) observations_.push_back(i);
  J_.resize(static_cast<Eigen::Index>(2 * observations_.size()), 6);
  r_.resize(J_.rows());
  for (std::size_t at = 0; at < observations_.size(); ++at) {
    const std::size_t i = observations_[at];
    const auto row = static_cast<Eigen::Index>(2 * at);
    const Equation equation(model, i, basis_);
    J_.middleRows<2>(row) = equation.J;
    r_.segment<2>(row) = equation.r;
    doubt_ = std::max(doubt_, equation.doubt);
    N_ += equation.J.transpose() * equation.J;
    g_ += equation.J.transpose() * equation.r;
  }
  fix_the_unused(basis_, N_);
  const SmallCholesky<6> cholesky(N_);
  determined_ = cholesky.ok();
  if (!determined_) return;
  fitted_ = r_ - J_ * cholesky.solve(g_);
  Y_.resize(J_.rows(), 6);
  for (Eigen::Index row = 0; row < J_.rows(); ++row) Y_.row(row) = cholesky.forward(J_.row(row).transpose());
}

std::vector<Deletion> LinearFit::sets(std::size_t k, double highest) const {
  if (!determined_) return {};
  SetSearch search(Y_, fitted_, k, highest);
  std::stable_sort(search.hits.begin(), search.hits.end(),
                   [](const auto& a, const auto& b) { return a.misfit < b.misfit; });
  std::vector<Deletion> deletions;
  for (const SetSearch::Hit& hit : search.hits) {
    Deletion& deletion = deletions.emplace_back();
    deletion.misfit = hit.misfit;
    for (std::size_t at = 0; at < observations_.size(); ++at)
      if ((hit.set >> at & 1) != 0) deletion.set.push_back(observations_[at]);
  }
  return deletions;
}

LinearFit::Sums LinearFit::without(const std::vector<std::size_t>& set) const {
  Sums sums{N_, g_, r_.squaredNorm()};
  for (std::size_t at = 0; at < observations_.size(); ++at) {
    if (!std::binary_search(set.begin(), set.end(), observations_[at])) continue;
    const auto row = static_cast<Eigen::Index>(2 * at);
    sums.N -= J_.middleRows<2>(row).transpose() * J_.middleRows<2>(row);
    sums.g -= J_.middleRows<2>(row).transpose() * r_.segment<2>(row);
    sums.squares -= r_.segment<2>(row).squaredNorm();
  }
  return sums;
}

double LinearFit::misfit_without(const std::vector<std::size_t>& set) const {
  const Sums sums = without(set);
  const SmallCholesky<6> cholesky(sums.N);
  return cholesky.ok() ? sums.squares - cholesky.forward(sums.g).squaredNorm() : no_tolerance;
}

Vector6 LinearFit::step_without(const std::vector<std::size_t>& set) const {
  const Sums sums = without(set);
  const SmallCholesky<6> cholesky(sums.N);
  if (!cholesky.ok()) return Vector6::Zero();
  Vector6 step = basis_ * cholesky.solve(sums.g);
  step.tail<3>() /= extent_mm_;
  return step;
}

std::vector<Deletion> exchanges(const PoseModel& model, const std::vector<std::size_t>& removed,
                                double highest) {
  const Matrix6 basis = basis_of(model);
  std::vector<std::size_t> active;
  std::vector<Equation> equations;
  Matrix6 N = Matrix6::Zero();
  Vector6 g = Vector6::Zero();
  for (std::size_t i = 0; i < model.size(); ++i) {
    if (!model.active(i)) continue;
    active.push_back(i);
    const Equation& equation = equations.emplace_back(model, i, basis);
    N += equation.J.transpose() * equation.J;
    g += equation.J.transpose() * equation.r;
  }
  fix_the_unused(basis, N);
  const SmallCholesky<6> cholesky(N);
  if (!cholesky.ok()) return {};
  const Matrix6 inverse = cholesky.inverse();
  const Vector6 step = inverse * g;
  double misfit = 0;
  for (Equation& equation : equations) {
    equation.r -= equation.J * step;
    misfit += equation.r.squaredNorm();
  }
  std::vector<Deletion> found;
  for (const std::size_t back : removed) {
    Equation added(model, back, basis);
    added.r -= added.J * step;
    const Matrix6x2 NJ = inverse * added.J.transpose();
    const Eigen::Matrix2d weight = (Eigen::Matrix2d::Identity() + added.J * NJ).inverse();
    const double with = misfit + added.r.dot(weight * added.r);
    const double limit = std::sqrt(highest) + added.doubt;
    for (std::size_t at = 0; at < active.size(); ++at) {
      const Equation& out = equations[at];
      const Eigen::Matrix2d share = out.J * NJ, pull = share * weight;
      const Eigen::Vector2d r = out.r - pull * added.r;
      const Eigen::Matrix2d Q =
          Eigen::Matrix2d::Identity() - out.J * inverse * out.J.transpose() + pull * share.transpose();
      const double rest = with - r.dot(Q.inverse() * r);
      if (!(Q.determinant() > least_redundancy) || !(rest <= limit * limit)) continue;
      Deletion& deletion = found.emplace_back();
      deletion.misfit = rest;
      deletion.set = removed;
      std::replace(deletion.set.begin(), deletion.set.end(), back, active[at]);
      std::sort(deletion.set.begin(), deletion.set.end());
    }
  }
  return found;
}

}  // namespace zeropose
