// What the cameras of a wheel's sensors see: a dark tyre with the lines of a projector on it (spec 70,
// wheel-alignment).
#pragma once

#include <Eigen/Core>
#include <vector>

#include "calib/camera_model.h"
#include "sim/painter.h"
#include "sim/tyre.h"

namespace zeropose {

// A line of light: the part of a plane through the projector's centre between two limits, its section across
// a bell curve. P: the projector's frame, z along its axis.
struct ProjectedLine {
  Eigen::Vector3d n_P = Eigen::Vector3d::UnitX();      // the plane's normal, of unit length
  Eigen::Vector3d along_P = Eigen::Vector3d::UnitY();  // unit vector in the plane, about across z
  double from = -1, to = 1;                            // along / z between which there is light
  double brightness = 1;                               // 0: this line is missing
};

struct LineProjector {
  Pose X_WP = Pose::Identity();
  std::vector<ProjectedLine> lines;
  double sigma_rad = 0.001;  // of a line's section
};

// Something on the tyre: mud, which throws little light back, or a thing that lies on it.
struct TyreStain {
  Eigen::Vector2d centre_mm = Eigen::Vector2d::Zero();  // on the wheel's plane
  double radius_mm = 5;
  double share = 0.1;  // of the light that comes back
};

struct TyreLight {
  double line_grey = 90;  // of a line on the tyre that is lit and seen along its normal
  double ambient_grey = 14;
  double unevenness = 0.15;  // amplitude of the rubber's smooth change of reflectance
  double letter_gain = 1.25;
  double rim_grey = 55, background_grey = 6;
  Illumination illumination;
};

struct TyreScene {
  TyreShape tyre;
  Pose X_WO = Pose::Identity();  // O: the wheel, its z axis out of the side wall
  LineProjector projector;
  TyreLight light;
  std::vector<TyreStain> stains;
  double blur_sigma_px = 0.8;
};

// Grey levels row by row, with blur and without noise, not clamped. Each pixel's ray is met with the tyre's
// surface (Newton, to 1e-4 mm), lit by every line's plane with the cosine of its angle; then the lens blurs.
std::vector<float> tyre_picture(const TyreScene& scene, const PixelRays& rays, const Pose& X_WC);

}  // namespace zeropose
