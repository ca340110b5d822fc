// How find_marks() measures a disc in pictures of hard_picture: its errors with and without noise.
#pragma once

#include <Eigen/Core>
#include <string>

#include "tests/support/hard_picture.h"

namespace zeropose::test {

struct Formation {
  HardLens lens;
  HardSensor sensor;
};
std::string name_of(const Formation& formation);

// Errors of the centre of a dark disc (greys 60 on 160).
struct FormationFigures {
  int found = 0;
  Eigen::Vector2d bias_px = Eigen::Vector2d::Zero();  // mean error
  double mean_px = 0;                                 // mean distance
  double rms_px = 0;                                  // per axis
  double sigma_px = 0;                                // as reported: root of the mean variance per axis
  double held = 0;                                    // share of marks in their 95 % ellipse
};

// Places at random over 8 px, the width of a block of compression, so that every phase of pixels and blocks
// comes up.
FormationFigures measure_without_noise(const Formation& formation, double diameter_px, int phases);
// The noise drawn anew for each of the draws at each phase.
FormationFigures measure_with_noise(const Formation& formation, double diameter_px, int phases, int draws);

}  // namespace zeropose::test
