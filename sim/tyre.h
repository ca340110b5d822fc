// The side wall of a tyre as a surface: what a wheel's sensors look at (spec 70, wheel-alignment).
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <string>
#include <vector>

namespace zeropose {

// A ridge (height above 0) or a groove round the axis, its section a bell curve.
struct TyreRing {
  double radius_mm = 0, height_mm = 0, sigma_mm = 1;
};

// Raised letters: cells round the axis, of which about two in three are a letter of a few strokes.
struct TyreLettering {
  double inner_mm = 0, outer_mm = 0;  // radii; equal: none
  double from_rad = 0, to_rad = 0;    // about the wheel's axis from x to y
  double letter_mm = 8, height_mm = 0.6;
  std::uint32_t word = 1;  // which letters
};

// Uneven by so many waves round the axis.
struct TyreWave {
  int waves = 1;
  double amplitude_mm = 0, phase_rad = 0;
};

// A lump that stands out of the side wall, a bell surface: dried mud, a repaired place.
struct TyreLump {
  Eigen::Vector2d centre_mm = Eigen::Vector2d::Zero();  // on the wheel's plane
  double height_mm = 0, sigma_mm = 4;
};

// In the frame of the wheel: z is its axis and points out of the side wall.
struct TyreShape {
  std::string name;
  double bead_mm = 0, tread_mm = 0;  // radii where the side wall begins and ends
  double widest_mm = 0;              // radius where it stands out most: there z = 0 without rings
  double drop_mm = 0;                // how far it has fallen half its height from there
  std::vector<TyreRing> rings;
  std::vector<TyreLettering> lettering;
  std::vector<TyreWave> waves;
  std::vector<TyreLump> lumps;
};

// Three that differ in size and section: "175/65 R14", "205/55 R16", "245/40 R19".
std::vector<TyreShape> example_tyres();

// Height over the plane z = 0 at a place of that plane, and its slope outwards (that of the section alone).
class TyreSurface {
 public:
  struct Height {
    double z_mm = 0, slope = 0;
    bool letter = false;
  };

  explicit TyreSurface(const TyreShape& shape);
  const TyreShape& shape() const { return shape_; }
  bool on_side_wall(double radius_mm) const {
    return radius_mm >= shape_.bead_mm && radius_mm <= shape_.tread_mm;
  }
  // Beyond the side wall its ends go on.
  Height at(const Eigen::Vector2d& place_mm) const;
  // The section alone.
  Height section(double radius_mm) const;

 private:
  // 0 beside letters, 1 on top of one, soft at its sides.
  double letter_at(double radius_mm, double angle_rad) const;

  TyreShape shape_;
  std::vector<float> z_mm_, slope_;
};

}  // namespace zeropose
