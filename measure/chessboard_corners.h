// Where the inner corners of a chessboard are, to a fraction of a pixel: the one place of the room that uses
// OpenCV.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "measure/image.h"

namespace zeropose {

// Row by row, from whichever corner and in whichever sense OpenCV chose; empty when the board is not there as
// a whole. Precondition: rows and cols at least 3, an image of at least 16 x 16 px.
std::vector<Eigen::Vector2d> chessboard_corners(const ImageView& image, int rows, int cols);

}  // namespace zeropose
