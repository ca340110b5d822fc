// Which disc in an image is which mark of a calibration body. Internal to the room.
#pragma once

#include <Eigen/Core>
#include <limits>
#include <span>
#include <vector>

#include "measure/body.h"
#include "measure/body_camera.h"
#include "measure/body_layout.h"
#include "measure/lattice.h"

namespace zeropose {

inline constexpr std::size_t no_disc = std::numeric_limits<std::size_t>::max();

struct Numbering {
  std::vector<std::size_t> disc_of;  // per mark, or no_disc
  std::size_t count = 0;             // of discs explained
  double rms_px = 0;
  RoughCamera camera;
};

struct Numberings {
  Numbering best;
  std::size_t next_best = 0;  // discs that the best numbering explains which gives them other numbers
};

// before: one or several guesses of the internals. Nothing found: best.count is 0.
Numberings number_discs(std::span<const LatticeDisc> discs, std::span<const BodyMark> marks,
                        const BodyLayout& layout, std::span<const RoughInternals> before);

}  // namespace zeropose
