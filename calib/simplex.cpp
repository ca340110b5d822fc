#include "calib/simplex.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace zeropose {
namespace {

struct Corner {
  Eigen::Vector2d at = Eigen::Vector2d::Zero();
  double response = 0;
};

}  // namespace

SimplexResult minimise(const SimplexProblem& problem) {
  SimplexResult result;
  const auto corner = [&](const Eigen::Vector2d& at) {
    ++result.evaluations;
    return Corner{at, problem.response(at)};
  };
  std::array<Corner, 3> corners{corner(problem.start),
                                corner(problem.start + Eigen::Vector2d(problem.step, 0)),
                                corner(problem.start + Eigen::Vector2d(0, problem.step))};
  auto& [B, M, W] = corners;
  while (result.evaluations < problem.max_evaluations) {
    std::sort(corners.begin(), corners.end(),
              [](const Corner& a, const Corner& b) { return a.response < b.response; });
    result.converged = std::max((M.at - B.at).norm(), (W.at - B.at).norm()) < problem.smallest_step;
    if (result.converged) break;
    const Corner reflected = corner(B.at + M.at - W.at);
    Corner taken = reflected;
    if (reflected.response < B.response) {
      const Corner expanded = corner(reflected.at + 0.5 * (reflected.at - W.at));
      if (expanded.response < reflected.response) taken = expanded;
    } else if (reflected.response >= M.response) {
      const bool outside = reflected.response < W.response;
      taken =
          corner(outside ? reflected.at + 0.25 * (W.at - reflected.at) : W.at + 0.25 * (reflected.at - W.at));
    }
    if (taken.response < W.response) {
      W = taken;
      continue;
    }
    M = corner(0.5 * (M.at + B.at));
    W = corner(0.5 * (W.at + B.at));
  }
  result.best = B.at;
  result.response = B.response;
  return result;
}

}  // namespace zeropose
