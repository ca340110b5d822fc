// Things a mark finder must not mistake for marks, and places for them clear of the marks.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "sim/painter.h"
#include "sim/random.h"

namespace zeropose {

// A round part of the picture that is taken.
struct Taken {
  Eigen::Vector2d centre_px = Eigen::Vector2d::Zero();
  double radius_px = 0;
};

// One piece round the origin of its sheet. `kind` counts through the kinds: slots, squares, half discs, bolt
// heads, scratches, glints, small holes, stains. Never a round disc between 6 and 60 mm in diameter that is
// darker than what is round it. `base_grey` is that of the panel.
std::vector<Thing> make_clutter(int kind, double base_grey, Random& random);

// Largest distance from the origin that the things reach, softness included.
double reach_mm(const std::vector<Thing>& things);

void move(std::vector<Thing>& things, const Eigen::Vector2d& by_mm);

// A place for a round thing in the picture that touches nothing taken; nullopt when 300 draws found none.
std::optional<Eigen::Vector2d> free_place(const CameraModel& camera, double radius_px,
                                          const std::vector<Taken>& taken, Random& random);

}  // namespace zeropose
