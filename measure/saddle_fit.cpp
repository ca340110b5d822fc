#include "measure/saddle_fit.h"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <vector>

namespace zeropose {
namespace {

using Eigen::MatrixXd;
using Eigen::Vector2d;
using Eigen::VectorXd;

constexpr int unknowns = 9;
enum Unknown { cu, cv, angle1, angle2, blur, mean, gu, gv, half_step };
constexpr double share_of_square = 0.4, largest_half_px = 12, farthest_px = 2.5;
constexpr double rounding_variance = 1.0 / 12;

struct Pixel {
  double u, v, grey;  // relative to the start
};

// The parallelogram round the start that reaches a share of a square along each edge.
std::vector<Pixel> pixels_round(const ImageView& image, const SaddleStart& start) {
  Eigen::Matrix2d reach = share_of_square * start.steps_px;
  for (int axis = 0; axis < 2; ++axis) {
    const double length = reach.col(axis).norm();
    if (length > largest_half_px) reach.col(axis) *= largest_half_px / length;
  }
  std::vector<Pixel> pixels;
  if (!(std::abs(reach.determinant()) > 4)) return pixels;
  const Eigen::Matrix2d inverse = reach.inverse();
  const Vector2d half = reach.cwiseAbs().rowwise().sum();
  const int u0 = std::max(0, static_cast<int>(std::ceil(start.u_px.x() - half.x())));
  const int u1 = std::min(image.width_px - 1, static_cast<int>(std::floor(start.u_px.x() + half.x())));
  const int v0 = std::max(0, static_cast<int>(std::ceil(start.u_px.y() - half.y())));
  const int v1 = std::min(image.height_px - 1, static_cast<int>(std::floor(start.u_px.y() + half.y())));
  for (int v = v0; v <= v1; ++v) {
    for (int u = u0; u <= u1; ++u) {
      const Vector2d off = Vector2d(u, v) - start.u_px;
      if ((inverse * off).cwiseAbs().maxCoeff() <= 1)
        pixels.push_back({off.x(), off.y(), image.grey_at(u, v)});
    }
  }
  return pixels;
}

// Signed distance from an edge through the crossing, its blurred sign and the derivative of that by the
// distance.
struct Edge {
  double distance, along, sign, density;

  Edge(double x, double y, double angle, double s) {
    const double c = std::cos(angle), n = std::sin(angle);
    distance = -n * x + c * y;
    along = c * x + n * y;
    const double t = distance / s;
    sign = std::erf(t / std::sqrt(2.0));
    density = std::sqrt(2 / 3.14159265358979323846) * std::exp(-0.5 * t * t) / s;
  }
};

struct Normal {
  MatrixXd N = MatrixXd::Zero(unknowns, unknowns);
  VectorXd g = VectorXd::Zero(unknowns);
  double squares = 0;
};

Normal evaluate(const std::vector<Pixel>& pixels, const VectorXd& at) {
  Normal normal;
  VectorXd row(unknowns);
  for (const Pixel& p : pixels) {
    const double x = p.u - at(cu), y = p.v - at(cv), s = at(blur), h = at(half_step);
    const Edge a(x, y, at(angle1), s), b(x, y, at(angle2), s);
    const double by_a = h * a.density * b.sign, by_b = h * b.density * a.sign;
    row(cu) = by_a * std::sin(at(angle1)) + by_b * std::sin(at(angle2));
    row(cv) = -by_a * std::cos(at(angle1)) - by_b * std::cos(at(angle2));
    row(angle1) = -by_a * a.along;
    row(angle2) = -by_b * b.along;
    row(blur) = -(by_a * a.distance + by_b * b.distance) / s;
    row(mean) = 1;
    row(gu) = p.u;
    row(gv) = p.v;
    row(half_step) = a.sign * b.sign;
    const double rest = p.grey - (at(mean) + at(gu) * p.u + at(gv) * p.v + h * a.sign * b.sign);
    normal.N.selfadjointView<Eigen::Lower>().rankUpdate(row);
    normal.g += rest * row;
    normal.squares += rest * rest;
  }
  normal.N = normal.N.selfadjointView<Eigen::Lower>();
  return normal;
}

bool plausible(const VectorXd& at) {
  return at.allFinite() && at(blur) > 0.2 && at(blur) < 5 && at.head<2>().norm() < farthest_px &&
         std::abs(std::sin(at(angle1) - at(angle2))) > 0.1;
}

// The level and step that suit the start's edges best.
VectorXd first_guess(const std::vector<Pixel>& pixels, const SaddleStart& start) {
  VectorXd at = VectorXd::Zero(unknowns);
  at(angle1) = std::atan2(start.steps_px(1, 0), start.steps_px(0, 0));
  at(angle2) = std::atan2(start.steps_px(1, 1), start.steps_px(0, 1));
  at(blur) = 1;
  double sum = 0, cross = 0, square = 0;
  for (const Pixel& p : pixels) sum += p.grey;
  at(mean) = sum / double(pixels.size());
  for (const Pixel& p : pixels) {
    const double shape = Edge(p.u, p.v, at(angle1), 1).sign * Edge(p.u, p.v, at(angle2), 1).sign;
    cross += shape * (p.grey - at(mean));
    square += shape * shape;
  }
  at(half_step) = square > 0 ? cross / square : 0;
  return at;
}

SaddleFit report(const SaddleStart& start, const VectorXd& at, const Normal& normal, std::size_t count) {
  SaddleFit fit;
  const Eigen::LDLT<MatrixXd> solver(normal.N);
  const double variance = std::max(normal.squares / double(count - unknowns), rounding_variance);
  const MatrixXd inverse = solver.solve(MatrixXd::Identity(unknowns, unknowns));
  fit.u_px = start.u_px + at.head<2>();
  fit.covariance_px2 = 0.5 * variance * (inverse + inverse.transpose()).topLeftCorner<2, 2>();
  // Both distances grow to the left of their edges (u right, v down: clockwise on the screen): between the
  // positive edges one of them is positive and the other one negative.
  fit.step_grey = -2 * at(half_step);
  fit.converged = solver.info() == Eigen::Success && fit.covariance_px2.allFinite() &&
                  fit.covariance_px2.determinant() > 0 && fit.covariance_px2(0, 0) > 0;
  return fit;
}

}  // namespace

SaddleFit fit_saddle(const ImageView& image, const SaddleStart& start) {
  const std::vector<Pixel> pixels = pixels_round(image, start);
  if (pixels.size() < 3 * unknowns) return {};
  VectorXd at = first_guess(pixels, start);
  Normal normal = evaluate(pixels, at);
  double lambda = 1e-3;
  for (int round = 0; round < 30 && lambda < 1e6; ++round) {
    MatrixXd damped = normal.N;
    damped.diagonal() *= 1 + lambda;
    const VectorXd step = damped.ldlt().solve(normal.g);
    const VectorXd next = at + step;
    if (!plausible(next)) {
      lambda *= 10;
      continue;
    }
    const Normal there = evaluate(pixels, next);
    if (!(there.squares <= normal.squares)) {
      lambda *= 10;
      continue;
    }
    at = next;
    normal = there;
    lambda *= 0.1;
    if (step.head<2>().norm() < 1e-5) return report(start, at, normal, pixels.size());
  }
  return {};
}

}  // namespace zeropose
