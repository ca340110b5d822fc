// The camera's pose from three points: the start where nothing else is known.
#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

#include "calib/rigid.h"

namespace zeropose {

// Every pose X_WC from which three points lie in the given directions of the camera's frame (any length), up
// to four of them, none where the points lie on a line or two directions agree. Where noise makes two of them
// one, both are what comes nearest. Grunert's equations as in Haralick et al., IJCV 13 (1994).
std::vector<Pose> poses_from_three(const std::array<Eigen::Vector3d, 3>& p_W_mm,
                                   const std::array<Eigen::Vector3d, 3>& d_C);

}  // namespace zeropose
