// Heaves and hollows of a tyre's section along the radial lines, and the ones that all lines share. Internal
// to the room.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "measure/wheel_axis.h"

namespace zeropose {

// Where the height over the wheel's plane is greatest (a heave) or least along a line. What path the line
// takes over the tyre does not matter: the height depends on the radius alone, and so does its extreme.
struct ProfileExtreme {
  bool heave = false;
  double radius_mm = 0, height_mm = 0;  // about the axis that was used
  double sigma_mm = 0;                  // of the height
  double sigma_radius_mm = 0;
  double bend_per_mm = 0;  // the section's second derivative: below 0 for a heave
  Eigen::Vector3d p_W_mm = Eigen::Vector3d::Zero();
};

struct ProfileSearch {
  double knot_spacing_mm = 2.5;  // of the spline along a line
  double neighbours_gain = 1;    // see there
  double least_rise_mm = 0.08;   // of an extreme over the deeper of its sides ...
  double least_rise_sigmas = 6;  // ... and in sigmas of the height
  double most_gap_mm = 1.5;      // between neighbouring points at an extreme ...
  double seen_about_mm = 1.5;    // ... and so far to either side of it
  double margin_mm = 4;          // from the ends of the line
};

// Of one line, in order of the radius. Empty where the line has too few points for a spline.
std::vector<ProfileExtreme> extremes_on_line(const SideLine& line, const WheelAxis& axis,
                                             const ProfileSearch& search);

// One extreme of every line, of the same kind.
using SharedProfile = std::vector<ProfileExtreme>;

struct SharedProfiles {
  std::vector<SharedProfile> all;          // the most bent first
  std::vector<std::size_t> lines_without;  // of the profile that the most lines share, where none has all
};

// Of the lines' extremes those within the tolerances of each other on all lines. A letter has an extreme on
// some lines only.
SharedProfiles shared_by_all(std::span<const std::vector<ProfileExtreme>> lines, double radius_tolerance_mm,
                             double height_tolerance_mm);

}  // namespace zeropose
