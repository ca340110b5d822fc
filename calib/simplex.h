// Nelder and Mead's search in two dimensions, with the steps of the source (spec 30 C5).
#pragma once

#include <Eigen/Core>
#include <functional>

namespace zeropose {

struct SimplexProblem {
  Eigen::Vector2d start = Eigen::Vector2d::Zero();
  double step = 8;              // side of the first triangle
  double smallest_step = 1e-4;  // converged when the triangle is smaller
  int max_evaluations = 1000;
  std::function<double(const Eigen::Vector2d&)> response;  // infinite where there is none
};

struct SimplexResult {
  bool converged = false;
  Eigen::Vector2d best = Eigen::Vector2d::Zero();
  double response = 0;
  int evaluations = 0;
};

SimplexResult minimise(const SimplexProblem& problem);

}  // namespace zeropose
