// The rows of the corpus of hard windows, and how many of each must be found.
#pragma once

#include <array>

#include "tests/support/hard_corpus.h"

namespace zeropose::test {

struct HardRow {
  HardCase given;
  int frames = 0;
  int least_found = 0;  // where a part is spoilt, one below what is reached: one case on the edge may turn
};

inline constexpr std::array hard_rows{
    HardRow{{Fault::none, 0}, 12, 12},
    HardRow{{Fault::gradient, 1.5}, 8, 8},
    HardRow{{Fault::gradient, 2}, 8, 8},
    HardRow{{Fault::gradient, 3}, 8, 8},
    HardRow{{Fault::low_contrast, 40}, 8, 8},
    HardRow{{Fault::low_contrast, 30}, 8, 8},
    HardRow{{Fault::low_contrast, 20}, 8, 8},
    HardRow{{Fault::glint, 0.05}, 8, 7},
    HardRow{{Fault::glint, 0.1}, 8, 6},
    HardRow{{Fault::glint, 0.2}, 8, 5},
    HardRow{{Fault::dirt, 4}, 8, 7},
    HardRow{{Fault::dirt, 10}, 8, 6},
    HardRow{{Fault::dirt, 25}, 8, 4},
    HardRow{{Fault::straight_cover, 0.05}, 8, 6},
    HardRow{{Fault::straight_cover, 0.1}, 8, 7},
    HardRow{{Fault::straight_cover, 0.2}, 8, 6},
    HardRow{{Fault::straight_cover, 0.3}, 8, 5},
    HardRow{{Fault::round_cover, 0.05}, 8, 7},
    HardRow{{Fault::round_cover, 0.1}, 8, 7},
    HardRow{{Fault::round_cover, 0.2}, 8, 7},
    HardRow{{Fault::round_cover, 0.3}, 8, 6},
    HardRow{{Fault::motion, 1}, 8, 8},
    HardRow{{Fault::motion, 2}, 8, 8},
    HardRow{{Fault::motion, 4}, 8, 8},
    HardRow{{Fault::motion, 6}, 8, 8},
    HardRow{{Fault::oil, 1}, 8, 7},
    HardRow{{Fault::oil, 2}, 8, 4},
    HardRow{{Fault::oil, 3}, 8, 1},
    HardRow{{Fault::defocus, 0.7}, 8, 8},
    HardRow{{Fault::defocus, 1.5}, 8, 8},
    HardRow{{Fault::defocus, 2.2}, 8, 8},
    HardRow{{Fault::defocus, 3}, 8, 8},
    HardRow{{Fault::clutter, 4}, 8, 8},
    HardRow{{Fault::clutter, 10}, 8, 8},
    HardRow{{Fault::compression, 95}, 8, 8},
    HardRow{{Fault::compression, 85}, 8, 8},
    HardRow{{Fault::compression, 70}, 8, 8},
    HardRow{{Fault::gamma, 0.7}, 8, 8},
    HardRow{{Fault::gamma, 0.45}, 8, 8},
    HardRow{{Fault::deep_pixels, 12}, 8, 8},
    HardRow{{Fault::combined, 2}, 16, 12},
    HardRow{{Fault::combined, 3}, 16, 13},
    HardRow{{Fault::hidden, 0}, 10, 0},
    HardRow{{Fault::hidden, 5}, 14, 0},
    HardRow{{Fault::absent, 0}, 4, 0},
    HardRow{{Fault::absent, 5}, 16, 0},
    HardRow{{Fault::absent, 12}, 12, 0},
};

}  // namespace zeropose::test
