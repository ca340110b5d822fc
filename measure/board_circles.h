// Boards of circles: from pixels to points. Internal to the room.
#pragma once

#include "measure/board.h"

namespace zeropose {

// Precondition: a problem that makes sense, an image of at least 2 x 2 px.
BoardResult find_circle_board(const ImageView& image, const BoardProblem& problem);

}  // namespace zeropose
