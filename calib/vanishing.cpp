#include "calib/vanishing.h"

#include <Eigen/QR>
#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <limits>

#include "calib/words.h"

namespace zeropose {
namespace {

using Eigen::MatrixXd;
using Eigen::Vector2d;
using Eigen::VectorXd;

// Pairs that agree this closely, relative to their distance, are one equation: parallel poses.
constexpr double same_pair_ratio = 1e-6;
// A condition beyond this leaves no digit of a pixel.
constexpr double largest_condition = 1e9;

VanishingResult failure(VanishingResult result, VanishingStatus status, std::string reason) {
  result.status = status;
  result.reason = std::move(reason);
  result.fx_px = result.fy_px = result.cx_px = result.cy_px = 0;
  result.estimated = {};
  return result;
}

bool near(const Vector2d& a, const Vector2d& b) {
  return (a - b).norm() <= same_pair_ratio * (1 + std::max(a.norm(), b.norm()));
}

bool same_equation(const VanishingPair& a, const VanishingPair& b) {
  return (near(a.v1_px, b.v1_px) && near(a.v2_px, b.v2_px)) ||
         (near(a.v1_px, b.v2_px) && near(a.v2_px, b.v1_px));
}

// Sorts the pairs into used and skipped.
void choose_pairs(const VanishingProblem& problem, VanishingResult& result) {
  for (std::size_t i = 0; i < problem.pairs.size(); ++i) {
    const VanishingPair& pair = problem.pairs[i];
    const double farthest_px = std::max(pair.v1_px.norm(), pair.v2_px.norm());
    const auto same = std::find_if(result.used.begin(), result.used.end(), [&](std::size_t other) {
      return same_equation(problem.pairs[other], pair);
    });
    if (problem.max_px > 0 && farthest_px > problem.max_px)
      result.skipped.push_back({i, number(farthest_px, 0) + " px to a vanishing point, farther than " +
                                       number(problem.max_px, 0)});
    else if (same != result.used.end())
      result.skipped.push_back({i, std::string("the same vanishing points as number ")
                                       .append(number(*same + 1))
                                       .append(": a parallel pose adds no equation")});
    else
      result.used.push_back(i);
  }
}

struct Linear {
  VectorXd x;
  double condition = 0;
};

// Least squares of A x = b with columns scaled to length 1.
Linear solve(const MatrixXd& A, const VectorXd& b) {
  const VectorXd scale = A.colwise().norm().transpose().cwiseMax(1e-300);
  const MatrixXd scaled = A * scale.cwiseInverse().asDiagonal();
  const Eigen::JacobiSVD<MatrixXd> svd(scaled);
  const VectorXd& sigma = svd.singularValues();
  const double least = A.rows() < A.cols() ? 0 : sigma(sigma.size() - 1);
  Linear linear;
  linear.condition = least > 0 ? sigma(0) / least : std::numeric_limits<double>::infinity();
  linear.x = scaled.colPivHouseholderQr().solve(b).cwiseQuotient(scale);
  return linear;
}

std::string poses_too_alike(const VanishingResult& result) {
  return number(result.used.size()) +
         " images do not determine the camera: their poses are too alike (turned about one axis only, or "
         "moved without turning)";
}

// One row per used pair.
MatrixXd rows_of(const VanishingProblem& problem, const VanishingResult& result, Eigen::Index columns,
                 const auto& row_of) {
  MatrixXd A(static_cast<Eigen::Index>(result.used.size()), columns);
  for (Eigen::Index i = 0; i < A.rows(); ++i)
    A.row(i) = row_of(problem.pairs[result.used[static_cast<std::size_t>(i)]]);
  return A;
}

VanishingResult with_focal_lengths(VanishingResult result, double inverse_fx2, double inverse_fy2,
                                   const Vector2d& origin_px, const ParameterSet& estimated) {
  if (!(inverse_fx2 > 0) || !(inverse_fy2 > 0))
    return failure(result, VanishingStatus::no_camera,
                   "no camera sees these vanishing points: the square of a focal length would be negative");
  result.status = VanishingStatus::ok;
  result.fx_px = 1 / std::sqrt(inverse_fx2);
  result.fy_px = 1 / std::sqrt(inverse_fy2);
  result.cx_px = origin_px.x();
  result.cy_px = origin_px.y();
  result.estimated = estimated;
  return result;
}

// fx, fy or fx = fy about the given origin: x1 / fx^2 + y1 / fy^2 = -1.
VanishingResult focal_from_origin(const VanishingProblem& problem, VanishingResult result) {
  const bool one = problem.one_focal || result.used.size() == 1;
  const MatrixXd A = rows_of(problem, result, one ? 1 : 2, [&](const VanishingPair& pair) {
    const Vector2d product = (pair.v1_px - *problem.origin_px).cwiseProduct(pair.v2_px - *problem.origin_px);
    return one ? VectorXd(VectorXd::Constant(1, product.sum())).transpose().eval()
               : VectorXd(product).transpose().eval();
  });
  const Linear linear = solve(A, -VectorXd::Ones(A.rows()));
  result.condition = linear.condition;
  if (!(linear.condition < largest_condition))
    return failure(result, VanishingStatus::not_determined, poses_too_alike(result));
  return with_focal_lengths(result, linear.x(0), linear.x(one ? 0 : 1), *problem.origin_px,
                            {Parameter::fx, Parameter::fy});
}

// All: X1X2 x1 + Y1Y2 x2 + (X1+X2) x3 + (Y1+Y2) x4 = -1; with fx = fy x1 and x2 are one. The pixels are not
// centred: over more pairs than unknowns that would be another least squares than the published one. The
// right side never vanishes in any frame: 1 + (cx/fx)^2 + (cy/fy)^2 >= 1.
VanishingResult focal_and_origin(const VanishingProblem& problem, VanishingResult result) {
  const bool one = problem.one_focal || result.used.size() == 3;
  const MatrixXd A = rows_of(problem, result, one ? 3 : 4, [&](const VanishingPair& pair) {
    const Vector2d product = pair.v1_px.cwiseProduct(pair.v2_px), sum = pair.v1_px + pair.v2_px;
    VectorXd row(one ? 3 : 4);
    if (one)
      row << product.sum(), sum;
    else
      row << product, sum;
    return row.transpose().eval();
  });
  const Linear linear = solve(A, -VectorXd::Ones(A.rows()));
  result.condition = linear.condition;
  if (!(linear.condition < largest_condition))
    return failure(result, VanishingStatus::not_determined, poses_too_alike(result));
  const double x1 = linear.x(0), x2 = linear.x(one ? 0 : 1);
  const Vector2d x34 = linear.x.tail(2), origin_px(-x34.x() / x1, -x34.y() / x2);
  const double w5 = 1 / (1 + origin_px.dot(x34));
  return with_focal_lengths(result, x1 * w5, x2 * w5, origin_px,
                            {Parameter::fx, Parameter::fy, Parameter::cx, Parameter::cy});
}

// Each pair puts the origin on a circle, in pixels divided by the focal lengths: |c - m|^2 = |v1 - v2|^2 / 4
// - 1 about the middle m.
struct Circles {
  MatrixXd centres;  // n x 2
  VectorXd square;   // of the radii
  Vector2d mean, along, across;
  double spread_along = 0, spread_across = 0;
};

Circles circles_of(const VanishingProblem& problem, const VanishingResult& result) {
  Circles circles;
  const auto scaled = [&](const Vector2d& v_px) { return v_px.cwiseQuotient(*problem.focal_px).eval(); };
  circles.centres = rows_of(problem, result, 2, [&](const VanishingPair& pair) {
    return (0.5 * (scaled(pair.v1_px) + scaled(pair.v2_px))).transpose().eval();
  });
  circles.square = rows_of(problem, result, 1, [&](const VanishingPair& pair) {
                     const double distance = (scaled(pair.v1_px) - scaled(pair.v2_px)).squaredNorm();
                     return VectorXd(VectorXd::Constant(1, distance / 4 - 1)).transpose().eval();
                   }).col(0);
  circles.mean = circles.centres.colwise().mean().transpose();
  const MatrixXd centred = circles.centres.rowwise() - circles.mean.transpose();
  const Eigen::JacobiSVD<MatrixXd> svd(centred, Eigen::ComputeFullV);
  circles.along = svd.matrixV().col(0);
  circles.across = svd.matrixV().col(1);
  circles.spread_along = svd.singularValues()(0);
  circles.spread_across = svd.singularValues()(1);
  return circles;
}

// Gauss-Newton on the sum of squared circle equations.
Vector2d polished(const Circles& circles, Vector2d c) {
  for (int step = 0; step < 20; ++step) {
    const MatrixXd from = c.transpose().replicate(circles.centres.rows(), 1) - circles.centres;
    const VectorXd residual = from.rowwise().squaredNorm() - circles.square;
    const Linear linear = solve(2 * from, -residual);
    if (!(linear.condition < largest_condition) || !linear.x.allFinite()) break;
    c += linear.x;
    if (linear.x.norm() < 1e-15 * (1 + c.norm())) break;
  }
  return c;
}

VanishingResult origin_from_focal(const VanishingProblem& problem, VanishingResult result) {
  const Circles circles = circles_of(problem, result);
  const double size = std::sqrt(circles.square.cwiseAbs().maxCoeff()) + 1;
  if (!(circles.spread_along > 1e-9 * size))
    return failure(result, VanishingStatus::not_determined, poses_too_alike(result));
  // Differences of the circles' equations are lines: the origin's place along the line of the centres.
  const MatrixXd centred = circles.centres.rowwise() - circles.mean.transpose();
  const VectorXd along = centred * circles.along;
  const VectorXd right = 0.5 * (along.cwiseAbs2() - circles.square);
  const double a = along.dot(VectorXd(right.array() - right.mean())) / along.squaredNorm();
  const double height2 = (circles.square - (VectorXd::Constant(along.size(), a) - along).cwiseAbs2()).mean();
  if (!(height2 >= 0))
    return failure(result, VanishingStatus::no_camera,
                   "no origin fits the pairs with these focal lengths: the circles about the middles of the "
                   "pairs do not meet");
  const Vector2d base = circles.mean + a * circles.along;
  const Vector2d candidates[2] = {base + std::sqrt(height2) * circles.across,
                                  base - std::sqrt(height2) * circles.across};
  Vector2d c = candidates[0];
  if (circles.spread_across > 1e-6 * circles.spread_along && result.used.size() > 2) {
    const auto misfit = [&](const Vector2d& candidate) {
      const MatrixXd from = candidate.transpose().replicate(centred.rows(), 1) - circles.centres;
      return (from.rowwise().squaredNorm() - circles.square).squaredNorm();
    };
    const Vector2d first = polished(circles, candidates[0]), second = polished(circles, candidates[1]);
    c = misfit(first) <= misfit(second) ? first : second;
  } else if (problem.near_px) {
    const Vector2d guess = problem.near_px->cwiseQuotient(*problem.focal_px);
    c = (candidates[0] - guess).norm() <= (candidates[1] - guess).norm() ? candidates[0] : candidates[1];
    c = polished(circles, c);
  } else {
    return failure(result, VanishingStatus::ambiguous,
                   "two origins fit these pairs: say about where the origin lies");
  }
  result.condition =
      solve(2 * (c.transpose().replicate(centred.rows(), 1) - circles.centres), circles.square).condition;
  if (!(result.condition < largest_condition))
    return failure(result, VanishingStatus::not_determined, poses_too_alike(result));
  const Vector2d focal = *problem.focal_px;
  return with_focal_lengths(result, 1 / (focal.x() * focal.x()), 1 / (focal.y() * focal.y()),
                            c.cwiseProduct(focal), {Parameter::cx, Parameter::cy});
}

std::size_t pairs_needed(const VanishingProblem& problem) {
  if (problem.origin_px) return 1;
  return problem.focal_px ? 2 : 3;
}

bool all_finite(const VanishingProblem& problem) {
  const auto finite = [](const std::optional<Vector2d>& v) { return !v || v->allFinite(); };
  return std::all_of(problem.pairs.begin(), problem.pairs.end(),
                     [](const auto& pair) { return pair.v1_px.allFinite() && pair.v2_px.allFinite(); }) &&
         finite(problem.origin_px) && finite(problem.focal_px) && finite(problem.near_px) &&
         std::isfinite(problem.max_px);
}

}  // namespace

VanishingResult calibrate_by_vanishing_points(const VanishingProblem& problem) {
  VanishingResult result;
  if (!all_finite(problem)) return failure(result, VanishingStatus::not_finite, "a number is not finite");
  if (problem.origin_px && problem.focal_px)
    return failure(result, VanishingStatus::wrong_problem,
                   "origin and focal lengths are both given: nothing is left to find");
  if (problem.focal_px && !(problem.focal_px->minCoeff() > 0))
    return failure(result, VanishingStatus::wrong_problem, "a focal length must be above 0");
  choose_pairs(problem, result);
  if (result.used.size() < pairs_needed(problem))
    return failure(result, VanishingStatus::too_few_pairs,
                   number(result.used.size()) + " usable pairs of vanishing points, at least " +
                       number(pairs_needed(problem)) +
                       " needed (4 for fx fy cx cy, 3 with fx = fy, 2 with the focal lengths given, 1 with "
                       "the origin given)");
  if (problem.origin_px) return focal_from_origin(problem, result);
  if (problem.focal_px) return origin_from_focal(problem, result);
  return focal_and_origin(problem, result);
}

}  // namespace zeropose
