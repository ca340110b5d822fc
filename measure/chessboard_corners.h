// Where the inner corners of a chessboard are, to a fraction of a pixel: the one place of the room that uses
// OpenCV.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "measure/image.h"

namespace zeropose {

// Row by row, from whichever corner and in whichever sense OpenCV chose; empty when there is none.
struct ChessboardCorners {
  int rows = 0, cols = 0;
  std::vector<Eigen::Vector2d> at_px;
};

// All of the board. Precondition: rows and cols at least 3, an image of at least 16 x 16 px.
ChessboardCorners chessboard_corners(const ImageView& image, int rows, int cols);

// The largest rectangle of corners, at least 3 x 3, of a board that is seen in part.
ChessboardCorners part_of_chessboard(const ImageView& image);

}  // namespace zeropose
