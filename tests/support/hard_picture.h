// How a lens and a camera turn a scene into a picture, faults included: diffraction, veil, defocus, motion,
// pixels with a fill factor, vignetting, noise of photons and of reading, gamma, compression.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <random>
#include <vector>

#include "measure/image.h"
#include "tests/support/hard_scene.h"

namespace zeropose::test {

struct HardLens {
  double first_zero_px = 1.5;  // of the diffraction pattern
  double second_zero_px = 0;   // of a second, wider one that stands for the lens errors
  double second_share = 0;     // of the light, in the second one
  double veil_share = 0;       // of the light, spread by a Gauss of veil_px
  double veil_px = 10;
  double defocus_px = 0;                                // radius of the disc of confusion
  Eigen::Vector2d motion_px = Eigen::Vector2d::Zero();  // during the exposure, about its middle
  double focal_px = 0;                                  // cos^4 of the angle to the axis; 0: none
  Eigen::Vector2d axis_px = Eigen::Vector2d::Zero();    // where the optical axis meets the picture
};

struct HardSensor {
  double fill_factor = 0.9;
  double full_well = 10000;  // electrons at white
  double read_noise = 12;    // electrons
  double gamma = 1;          // grey = white * light^gamma
  int white = 255;           // above 255: two bytes per pixel
  int quality = 0;           // of the compression, 1..100; 0: none. Only with one byte per pixel.
};

// Light on each pixel in units of white, without noise.
struct Irradiance {
  int width_px = 0, height_px = 0;
  std::vector<double> light;
};

struct Shot {
  int width_px = 0, height_px = 0, white = 255;
  std::vector<std::uint8_t> bytes;

  ImageView view() const {
    return {bytes.data(), width_px, height_px, std::ptrdiff_t{width_px} * (white > 255 ? 2 : 1), white};
  }
};

Irradiance expose_scene(const HardScene& scene, const HardLens& lens, const HardSensor& sensor);

// One exposure: noise drawn anew, then gamma, rounding and compression.
Shot shoot(const Irradiance& irradiance, const HardSensor& sensor, std::mt19937_64& random);
Shot shoot_without_noise(const Irradiance& irradiance, const HardSensor& sensor);

}  // namespace zeropose::test
