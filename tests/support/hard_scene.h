// What lies before the lens, as light on a grid of fine cells: marks, dirt, glints, oil, things that cover.
// Shares nothing with the estimators nor with mark_picture: plain sub-sampling of shapes given by their
// distance.
#pragma once

#include <Eigen/Core>
#include <functional>
#include <random>
#include <vector>

namespace zeropose::test {

inline constexpr int cells_per_px = 8;

// One thing laid over what is there before.
struct Layer {
  // Negative inside; near the outline about the distance to it, px.
  std::function<double(const Eigen::Vector2d& at_px)> distance_px;
  Eigen::Vector2d low_px = Eigen::Vector2d::Zero(), high_px = Eigen::Vector2d::Zero();  // box that holds it
  double grey = 0;     // of its surface, as the camera would show it
  double opacity = 1;  // 0..1
  double soft_px = 0;  // width of its fading rim, inwards
  double glow = 0;     // light it adds, in units of white; then grey and opacity do not count
  double lens = 0;     // a drop: how much it bends what lies below, 0..1; then grey does not count
};

struct HardScene {
  int width_px = 0, height_px = 0;
  double ground_grey = 150;
  std::vector<Layer> layers;
  // Light of a plane across the picture: brightest by darkest side, 1: even.
  double light_ratio = 1, light_direction_rad = 0;
};

// Light on the scene in units of white, cells_per_px x cells_per_px per pixel, with a margin round the
// picture. The cell (0, 0) is the top-left one of the pixel (-margin, -margin).
struct Radiance {
  int width_cells = 0, height_cells = 0, margin_px = 0;
  std::vector<float> cells;
};

// gamma: the camera's, with which greys are turned into light.
Radiance radiance_of(const HardScene& scene, double gamma, int margin_px);

Layer disc_layer(const Eigen::Vector2d& centre_px, double diameter_px, double axis_ratio, double angle_rad,
                 double grey);
// Rectangle of the given half lengths along and across the angle.
Layer bar_layer(const Eigen::Vector2d& centre_px, double half_length_px, double half_width_px,
                double angle_rad, double grey);
// Regular polygon.
Layer polygon_layer(const Eigen::Vector2d& centre_px, double radius_px, int corners, double angle_rad,
                    double grey);
// A splash: its radius wanders along the angle.
Layer splash_layer(const Eigen::Vector2d& centre_px, double radius_px, double grey, std::mt19937_64& random);
// A reflection: an ellipse of light that fades out.
Layer glint_layer(const Eigen::Vector2d& centre_px, double length_px, double width_px, double angle_rad,
                  double glow);
// A drop of oil: bends what lies below and has a bright rim.
std::vector<Layer> drop_layers(const Eigen::Vector2d& centre_px, double radius_px, double lens);

}  // namespace zeropose::test
