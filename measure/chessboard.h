// Chessboards: from pixels to points. Internal to the room.
#pragma once

#include "measure/board.h"

namespace zeropose {

// Precondition: a problem that makes sense, an image of at least 16 x 16 px.
BoardResult find_chessboard(const ImageView& image, const BoardProblem& problem);

}  // namespace zeropose
