// What an estimate from pixels minimises.
#pragma once

namespace zeropose {

// reprojection: found minus projected pixel, weighted with the observation's covariance: maximum likelihood.
// algebraic: the camera equations (E1) multiplied by depth and focal length, as the source has them (spec 30
// C6, spec 50 M3); reproduces its published numbers.
enum class Residual { reprojection, algebraic };

}  // namespace zeropose
