// A flat calibration board in an image: circle grids and chessboards to points (spec 40 P1).
#pragma once

#include <Eigen/Core>
#include <string>
#include <string_view>
#include <vector>

#include "measure/image.h"

namespace zeropose {

enum class BoardKind { circles, asymmetric_circles, chessboard };
std::string_view name_of(BoardKind kind);

// Place of a circle or inner corner on the board, counted from 0.
struct BoardIndex {
  int row = 0, col = 0;
  bool operator==(const BoardIndex&) const = default;
};

// What to look for. Circles may be dark on light or light on dark; either is tried.
struct BoardProblem {
  BoardKind kind = BoardKind::circles;
  int rows = 0, cols = 0;  // of circles, or of inner corners: at least 2 each, of a chessboard 3
  double pitch_mm = 0;     // circles: between neighbours in a row; asymmetric: half of that; side of a square
  // Accept also a part of the board whose place on the board is not known. See BoardResult.
  bool partial = false;
  double least_share = 0.3;     // of the circles or corners, that must be found
  double min_diameter_px = 6;   // of a circle's longer axis
  double min_axis_ratio = 0.2;  // of a circle: about 0.34 at a tilt of 70 degrees
  double min_contrast = 15;     // grey levels, of circles
};

struct BoardPoint {
  BoardIndex at;
  Eigen::Vector3d p_B_mm = Eigen::Vector3d::Zero();
  Eigen::Vector2d u_px = Eigen::Vector2d::Zero();  // circle: centre of its image, not the image of its centre
  Eigen::Matrix2d covariance_px2 = Eigen::Matrix2d::Zero();
  double diameter_px = 0;  // longer axis; 0 for a corner
};

enum class BoardStatus {
  failed = 0,
  found,
  wrong_problem,  // rows, columns, pitch or limits that make no sense
  empty_image,
  no_grid,     // nothing, or nothing regular
  too_few,     // less than least_share
  wrong_size,  // a grid that is larger than the board
  ambiguous    // a part that fits the board in more than one place
};
std::string_view name_of(BoardStatus status);

// Points are given only when the board was found, by row, then column. The frame B: x along the columns, y
// along the rows, z = 0, z axis away from the camera, so that in the image the turn from growing column to
// growing row is the same as from u to v: a mirrored reading is impossible. Circles: (col, row) times the
// pitch; asymmetric as in OpenCV: ((2 col + row % 2), row) times the pitch.
//
// A symmetric board looks the same after half a turn (square: a quarter turn), and so does an asymmetric one
// with an even number of rows. Then the first point (row 0, column 0) is the one of the equivalent corners
// that is nearest to the image's top left pixel; of a chessboard first of all one whose corner square is
// dark, where they differ. This is repeatable, but it is the image that decides, not the board:
// `equivalent_readings` says how many there are. Poses of the board that must agree between images (a stage,
// a robot's hand, several cameras) need a board with one reading, or images in which its turn stays within
// the same quarter.
//
// Hidden circles are left out and listed in `missing`. When the visible part fits the board in more than one
// place (an outer row or column hidden as a whole), the answer is `ambiguous`: a guess would move the board's
// frame by whole pitches. With `partial` it is `found` instead: the smallest row and column found are then 0
// (or 1, where the zigzag wants it), `place_known` is false, and points outside the visible part are not
// listed as missing. That serves a calibration in which every view has a pose of its own, and nothing else.
struct BoardResult {
  BoardStatus status = BoardStatus::failed;
  std::string reason;  // one sentence with the numbers; empty when all of the board was found
  std::vector<BoardPoint> points;
  std::vector<BoardIndex> missing;
  int equivalent_readings = 0;
  bool place_known = false;
  bool dark_on_light = false;  // circles
};

// Pure and repeatable bit by bit. Circle centres by the same maximum-likelihood fit as marks; a circle that
// is cut by the image's border or half hidden is missing, not biased. What does not lie on the grid (of the
// plane seen through a lens with radial distortion) is left out as clutter. A chessboard must be seen as a
// whole, with a light border round it; with `partial` its largest rectangle of corners is found, and which of
// its directions are the board's rows is then not known either.
BoardResult find_board(const ImageView& image, const BoardProblem& problem);

// The point's place in the board's frame, mm.
Eigen::Vector3d place_on_board(const BoardProblem& problem, const BoardIndex& at);

}  // namespace zeropose
