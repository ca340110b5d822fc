#include "calib/point_fit.h"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>

#include "calib/chance.h"
#include "calib/symmetric_eigen.h"

namespace zeropose {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr int max_rounds = 100;
constexpr double max_condition = 1e13;

struct Sums {
  MatrixXd N;
  VectorXd g;
  double cost = 0;
  Eigen::Index equations = 0;
};

void add(const PointRows& rows, Sums& sums) {
  if (rows.r.size() == 0) return;
  sums.N.noalias() += rows.J.transpose() * rows.J;
  sums.g.noalias() += rows.J.transpose() * rows.r;
  sums.cost += rows.r.squaredNorm();
  sums.equations += rows.r.size();
}

// False: a used point has no image.
bool sum_up(const PointEquations& equations, const std::vector<bool>& used, Sums& sums) {
  const Eigen::Index n = equations.unknowns();
  sums = {MatrixXd::Zero(n, n), VectorXd::Zero(n), 0, 0};
  PointRows rows;
  for (std::size_t i = 0; i < equations.points(); ++i) {
    if (!used[i]) continue;
    if (!equations.linearise(i, rows)) return false;
    add(rows, sums);
  }
  if (!equations.linearise_rest(rows)) return false;
  add(rows, sums);
  return std::isfinite(sums.cost);
}

VectorXd scales_of(const MatrixXd& N) {
  return N.diagonal().unaryExpr([](double x) { return x > 0 ? 1 / std::sqrt(x) : 1.0; });
}

// The inverse of the normal matrix and its condition; empty when singular.
void finish(const Sums& sums, PointFit& fit) {
  const VectorXd scale = scales_of(sums.N);
  const MatrixXd N = scale.asDiagonal() * sums.N * scale.asDiagonal();
  const VectorXd values = symmetric_eigen(N).values;
  const double least = values.minCoeff();
  fit.cost = sums.cost;
  fit.redundancy = static_cast<int>(sums.equations - sums.N.rows());
  fit.condition = least > 0 ? values.maxCoeff() / least : std::numeric_limits<double>::infinity();
  if (!(fit.condition < max_condition) || fit.redundancy < 0) {
    fit.status = PointFitStatus::not_determined;
    return;
  }
  const MatrixXd inverse = N.ldlt().solve(MatrixXd::Identity(N.rows(), N.cols()));
  fit.inverse_N = scale.asDiagonal() * (0.5 * (inverse + inverse.transpose())) * scale.asDiagonal();
}

enum class Step { taken, last, stuck };

// One step, damped until the cost falls.
Step step(std::unique_ptr<PointEquations>& at, const std::vector<bool>& used, Sums& sums, double& damping) {
  const VectorXd scale = scales_of(sums.N);
  for (int attempt = 0; attempt < 25; ++attempt) {
    MatrixXd N = scale.asDiagonal() * sums.N * scale.asDiagonal();
    N.diagonal() *= 1 + damping;
    const VectorXd scaled = N.ldlt().solve(scale.cwiseProduct(sums.g));
    const double gain = scaled.dot(scale.cwiseProduct(sums.g));
    // What a step can still gain is far below anything that noise leaves.
    const bool last = std::abs(gain) <= 1e-9 * sums.cost + 1e-16 && damping < 1e-2;
    auto next = at->copy();
    Sums there;
    if (scaled.allFinite()) next->move(scale.cwiseProduct(scaled));
    if (scaled.allFinite() && sum_up(*next, used, there) && there.cost <= sums.cost) {
      at = std::move(next);
      sums = std::move(there);
      damping = damping < 1e-9 ? 0 : damping * 0.1;
      return last ? Step::last : Step::taken;
    }
    if (last) return Step::last;
    damping = std::max(1e-6, damping * 10);
  }
  return Step::stuck;
}

}  // namespace

PointFit fit_points(const PointEquations& start, const std::vector<bool>& used) {
  PointFit fit;
  fit.at = start.copy();
  Sums sums;
  if (!sum_up(*fit.at, used, sums)) {
    fit.status = PointFitStatus::no_image;
    return fit;
  }
  double damping = 1e-4;
  Step last = Step::taken;
  for (int round = 0; round < max_rounds && last == Step::taken; ++round)
    last = step(fit.at, used, sums, damping);
  fit.status = last == Step::last ? PointFitStatus::ok : PointFitStatus::not_converged;
  finish(sums, fit);
  return fit;
}

double sigma_of_fit(const PointFit& fit, const WrongPointOptions& options) {
  if (options.sigma_px > 0) return options.sigma_px;
  if (fit.redundancy < 1) return 0;
  return std::max(options.least_sigma_px, std::sqrt(fit.cost / fit.redundancy));
}

bool fits_its_noise(const PointFit& fit, const WrongPointOptions& options) {
  if (options.sigma_px == 0 || fit.redundancy < 1) return true;
  const double squares = fit.cost / (options.sigma_px * options.sigma_px);
  return chi_square_tail(squares, fit.redundancy) >= options.false_alarm;
}

bool better_by_chance(const PointFit& all, const PointFit& best, int rows, std::size_t looks,
                      const WrongPointOptions& options) {
  const double sigma = sigma_of_fit(best, options);
  const double gain = (all.cost - best.cost) / (sigma * sigma);
  const double tail =
      options.sigma_px > 0 ? chi_square_tail(gain, rows) : fisher_tail(gain / rows, rows, best.redundancy);
  return tail * static_cast<double>(looks) >= options.false_alarm;
}

namespace {

struct Without {
  std::size_t point = 0;
  PointFit fit;
};

// The fits without one more point, best first; those that leave nothing to check themselves are not among
// them.
std::vector<Without> fits_without(const PointFit& all, const std::vector<bool>& used, int least_redundancy) {
  std::vector<Without> fits;
  for (std::size_t i = 0; i < used.size(); ++i) {
    if (!used[i]) continue;
    std::vector<bool> fewer = used;
    fewer[i] = false;
    PointFit fit = fit_points(*all.at, fewer);
    if (fit.status == PointFitStatus::ok && fit.redundancy >= least_redundancy)
      fits.push_back({i, std::move(fit)});
  }
  std::sort(fits.begin(), fits.end(),
            [](const Without& a, const Without& b) { return a.fit.cost < b.fit.cost; });
  return fits;
}

}  // namespace

WrongPoints remove_wrong_points(PointFit all, std::vector<bool>& used, const WrongPointOptions& options) {
  WrongPoints wrong;
  wrong.fit = std::move(all);
  for (;;) {
    wrong.sigma_px = sigma_of_fit(wrong.fit, options);
    wrong.agree = fits_its_noise(wrong.fit, options);
    if (wrong.agree && options.sigma_px > 0) return wrong;
    std::vector<Without> without = fits_without(wrong.fit, used, options.least_redundancy);
    const int rows = static_cast<int>(wrong.fit.at->rows_per_point());
    if (without.empty() || better_by_chance(wrong.fit, without.front().fit, rows, without.size(), options))
      return wrong;
    const double sigma = sigma_of_fit(without.front().fit, options);
    for (const Without& other : without)
      if (other.fit.cost - without.front().fit.cost < undecided_squares * sigma * sigma)
        wrong.suspects.push_back(other.point);
    if (wrong.suspects.size() > 1) {
      wrong.agree = false;
      return wrong;
    }
    wrong.suspects.clear();
    wrong.removed.push_back(without.front().point);
    used[without.front().point] = false;
    wrong.fit = std::move(without.front().fit);
  }
}

}  // namespace zeropose
