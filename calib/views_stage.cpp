#include "calib/views_stage.h"

#include <algorithm>

#include "calib/symmetric_eigen.h"
#include "calib/views.h"
#include "calib/views_checks.h"

namespace zeropose::bundle {
namespace {

// Boards that stand still but for rounding, mm.
constexpr double still_mm = 1e-6;
// A direction that moves the boards by less than this part of what the best one does is left alone: a
// straight stage whose table has its crookedness, too, does not tell how it is turned about its own axis.
constexpr double idle = 0.01;
constexpr double rounding = 1e-12;

double size_of_board(const ViewsProblem& problem) {
  std::vector<Eigen::Vector3d> points;
  for (const ViewPoint& seen : problem.points) points.push_back(seen.point.p_W_mm);
  return points.empty() ? 1 : std::max(best_plane(points).spread.norm(), still_mm);
}

// A pure translation shows how the stage is turned about any axis but its own, and no shift; turns about an
// axis show shifts across it. So: the directions in which the boards' motions, turns as mm at the board's
// size, are sensitive.
Eigen::MatrixXd directions_that_move(const Stage& stage, double size_mm) {
  Vector6 in_mm;
  in_mm << 1, 1, 1, size_mm, size_mm, size_mm;
  Matrix6 squares = Matrix6::Zero();
  for (std::size_t v = 0; v < stage.X_S1S.size(); ++v) {
    if (!stage.moves(v)) continue;
    const Matrix6 J =
        in_mm.asDiagonal() * stage.by_stage(v, Pose::Identity()) * in_mm.cwiseInverse().asDiagonal();
    squares += J.transpose() * J;
  }
  const SymmetricEigen eigen = symmetric_eigen(squares);
  const double least = std::max(still_mm * still_mm / (size_mm * size_mm), idle * idle * eigen.values[5]);
  const auto count = (eigen.values.array() > least).count();
  Eigen::MatrixXd directions = eigen.vectors.rightCols(count);
  directions = (directions.array().abs() < rounding).select(0, directions);
  return in_mm.cwiseInverse().asDiagonal() * directions;
}

}  // namespace

Pose Stage::X_WB(std::size_t view, const Pose& X_BS) const {
  return X_WB1 * X_BS * *X_S1S[view] * X_BS.inverse();
}

// Of X_B1B = X M X^-1, then along the axes of W.
Matrix6 Stage::by_stage(std::size_t view, const Pose& X_BS) const {
  const Pose X_B1B = X_BS * *X_S1S[view] * X_BS.inverse();
  const Eigen::Matrix3d R = X_B1B.linear(), rest = Eigen::Matrix3d::Identity() - R;
  Matrix6 A = Matrix6::Zero();
  A.topLeftCorner<3, 3>() = A.bottomRightCorner<3, 3>() = rest;
  A.topRightCorner<3, 3>() =
      cross_matrix(R * X_BS.translation()) * rest - cross_matrix(X_BS.linear() * X_S1S[view]->translation());
  Matrix6 turn = Matrix6::Zero();
  turn.topLeftCorner<3, 3>() = turn.bottomRightCorner<3, 3>() = X_WB1.linear();
  return turn * A;
}

std::optional<Stage> stage_of(const ViewsProblem& problem) {
  const auto first =
      std::ranges::find_if(problem.views, [](const BoardView& view) { return view.X_WB.has_value(); });
  if (first == problem.views.end()) return std::nullopt;
  Stage stage;
  stage.X_WB1 = *first->X_WB;
  for (const BoardView& view : problem.views) {
    stage.X_S1S.emplace_back();
    if (view.X_WB && &view != &*first) stage.X_S1S.back() = stage.X_WB1.inverse() * *view.X_WB;
  }
  stage.directions = directions_that_move(stage, size_of_board(problem));
  if (stage.directions.cols() == 0) return std::nullopt;
  return stage;
}

}  // namespace zeropose::bundle
