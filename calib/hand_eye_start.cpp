#include <algorithm>
#include <cmath>

#include "calib/hand_eye_parts.h"
#include "calib/symmetric_eigen.h"

namespace zeropose::hand_eye {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using Matrix9 = Eigen::Matrix<double, 9, 9>;

// R_FG X = Y R_CB for all: vec Y is the sum of (R_CB (x) R_FG) vec X, so X is the right singular vector of
// that sum with the largest singular value. No angle is singled out.
Matrix3d rotation_GB(std::span<const Loop> loops) {
  Matrix9 K = Matrix9::Zero();
  for (const Loop& loop : loops)
    for (int row = 0; row < 3; ++row)
      for (int column = 0; column < 3; ++column)
        K.block<3, 3>(3 * row, 3 * column) +=
            loop.X_CB.linear()(row, column) * loop.X_FG.linear() / static_cast<double>(loops.size());
  const Eigen::VectorXd largest = symmetric_eigen(K.transpose() * K).vectors.col(8);
  Matrix3d X = Eigen::Map<const Matrix3d>(largest.data());
  if (X.determinant() < 0) X = -X;
  return nearest_rotation(X);
}

// Rank of a loop's error where mm and degrees meet: a degree at the distance of a few hundred mm.
double size_of(const Vector6& error) { return error.head<3>().norm() + 300 * error.tail<3>().norm(); }

double median_error(const State& state, std::span<const Loop> loops) {
  std::vector<double> errors;
  for (const Loop& loop : loops) errors.push_back(size_of(error_of(state, loop)));
  std::ranges::sort(errors);
  return errors[errors.size() / 2];
}

}  // namespace

Pose X_FG_of(HandEyeSetup setup, const Pose& X_RH) {
  return setup == HandEyeSetup::eye_to_hand ? X_RH : X_RH.inverse();
}

std::vector<Loop> loops_of(HandEyeSetup setup, std::span<const SeenView> views) {
  std::vector<Loop> loops;
  for (const SeenView& view : views) loops.push_back({X_FG_of(setup, view.X_RH), view.X_CB});
  return loops;
}

State closed_form(std::span<const Loop> loops) {
  State state;
  state.X_GB.linear() = rotation_GB(loops);
  Matrix3d sum = Matrix3d::Zero();
  for (const Loop& loop : loops)
    sum += loop.X_FG.linear() * state.X_GB.linear() * loop.X_CB.linear().transpose();
  state.X_FC.linear() = nearest_rotation(sum);
  // R_FG t_GB + t_FG - R_FC t_CB = t_FC for all.
  std::vector<Pose> poses;
  for (const Loop& loop : loops) {
    Pose pose = loop.X_FG;
    pose.translation() -= state.X_FC.linear() * loop.X_CB.translation();
    poses.push_back(pose);
  }
  const FixedPoint fixed = fixed_point(poses);
  state.X_GB.translation() = fixed.p_mm;
  state.X_FC.translation() = fixed.c_mm;
  return state;
}

Vector6 error_of(const State& state, const Loop& loop) {
  return difference(loop.X_FG * state.X_GB, state.X_FC * loop.X_CB);
}

State robust_start(std::span<const Loop> loops) {
  State best = closed_form(loops);
  double least = median_error(best, loops);
  for (std::size_t i = 0; i < loops.size() && loops.size() > 4; ++i) {
    std::vector<Loop> rest(loops.begin(), loops.end());
    rest.erase(rest.begin() + static_cast<std::ptrdiff_t>(i));
    const State state = closed_form(rest);
    const double error = median_error(state, loops);
    if (error < least) least = error, best = state;
  }
  return best;
}

}  // namespace zeropose::hand_eye
