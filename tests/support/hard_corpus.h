// Windows with one mark each and a fault of a given strength, as works produce them; the truth is known.
#pragma once

#include <Eigen/Core>
#include <random>
#include <string>

#include "measure/marks.h"
#include "tests/support/hard_picture.h"

namespace zeropose::test {

enum class Fault {
  none,
  gradient,        // strength: brightest by darkest side of the picture
  low_contrast,    // grey levels
  glint,           // share of the outline under a saturated reflection
  dirt,            // specks on and about the mark; from 10 on a splash across the outline too
  straight_cover,  // share of the outline behind something straight
  round_cover,     // or round
  motion,          // px
  oil,             // drops across the outline
  defocus,         // sigma, px: half the radius of the disc of confusion
  clutter,         // things beside the mark
  compression,     // quality
  gamma,           // of the camera
  deep_pixels,     // bits
  combined,        // how many of the above at once, each of a middle strength
  hidden,          // nothing of the mark can be seen: this many things beside what covers it
  absent           // there is no mark: this many things
};

std::string name_of(Fault fault);

struct HardCase {
  Fault fault = Fault::none;
  double strength = 0;
};

struct HardFrame {
  Shot shot;
  MarkSearch search;
  bool visible = true;                                  // at least a part of the mark
  Eigen::Vector2d centre_px = Eigen::Vector2d::Zero();  // exact
};

// Discs and holes, dark and bright, 12..60 px, axis ratio 0.4..1 (shorter axis at least 6 px, and enough to
// survive the blur: 5 sigma of defocus, twice the motion), up to 20 px from where they are expected. Same
// case and seed: same frame.
HardFrame hard_frame(const HardCase& given, unsigned seed);

}  // namespace zeropose::test
