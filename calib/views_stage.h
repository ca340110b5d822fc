// Boards that are moved in known ways. Internal to calib.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "calib/rigid.h"

namespace zeropose {
struct ViewsProblem;
}

namespace zeropose::bundle {

// Known poses take the board's axes for those of the stage S that moves it; X_BS, constant and nearly the
// identity, is what they leave out. In the first known view the board stands where its pose says, which is
// what W is, and from there it makes the stage's motion: X_WB = X_WB1 X_BS X_S1S X_BS^-1.
struct Stage {
  Pose X_WB1 = Pose::Identity();
  std::vector<std::optional<Pose>> X_S1S;  // by view; none: the first known one, and those that are not
  Eigen::MatrixXd directions;              // 6 x n: the deltas of moved(X_BS) that move a board

  bool moves(std::size_t view) const { return X_S1S[view].has_value(); }
  Pose X_WB(std::size_t view, const Pose& X_BS) const;
  // d moved(X_WB) / d moved(X_BS).
  Matrix6 by_stage(std::size_t view, const Pose& X_BS) const;
};

// Nothing where the known poses do not differ: nobody can tell how the board sits on what does not move.
std::optional<Stage> stage_of(const ViewsProblem& problem);

}  // namespace zeropose::bundle
