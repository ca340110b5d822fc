// A gap on an oblique plane before a camera of a robot's hand, drawn from its truth in mm without any code of
// the estimators: every edge is projected point by point through the lens.
#pragma once

#include <random>
#include <vector>

#include "measure/gap.h"
#include "tests/support/outline_picture.h"

namespace zeropose::test {

struct GapScene {
  double gap_mm = 4, wedge_rad = 0;  // at the window's centre; positive: it widens along along_H
  // The frame's edge beside that, outwards where it is measured, and turned there.
  double frame_off_mm = 0, frame_turn_rad = 0;
  double turn_rad = 0;  // of the gap in the plane: 0 crosses it along the image's columns
  double tilt_rad = 0.5, tilt_about_rad = 0;  // of the plane against the image, about a direction in it
  double distance_mm = 100;                   // along the line of sight
  Eigen::Vector2d centre_px{120.3, 99.6};     // where the gap is
  double lens_K = -0.2;                       // division model
  double frame_grey = 150, gap_grey = 50, pane_grey = 120, blur_px = 0.8;
  Eigen::Vector2d shading_per_px = Eigen::Vector2d::Zero();
  std::vector<Polygon> dirt{};  // px, painted last
  Pose X_HC = Pose::Identity();

  CameraModel model() const;
  Eigen::Vector3d centre_C_mm() const;  // the point of the plane at centre_px
  Eigen::Matrix3d R_CG() const;  // across the gap from the frame to the pane, along it, the plane's normal
};

// Anything random that the tests vary: tilt of 20 to 40 degrees, gap of 3 to 5 mm, place, turn, hand.
GapScene random_gap(std::mt19937_64& random);

// The pixel of the point of the plane that is `across` and `along` mm from the gap's centre.
Eigen::Vector2d pixel_of(const GapScene& scene, double across_mm, double along_mm);

// A point of an edge, `along` mm from where the gap is measured.
Eigen::Vector2d edge_pixel(const GapScene& scene, bool frame, double along_mm);

Picture paint(const GapScene& scene);

// A problem with a window of 140 x 90 px about the gap; the image is set by the caller.
GapProblem problem_of(const GapScene& scene);

// Of one exposure, with noise of 2 grey levels drawn anew.
GapResult measured(const GapScene& scene, const Picture& picture, std::mt19937_64& random);
GapResult measured(const GapScene& scene, std::mt19937_64& random);

// An irregular blob of about so many px across, and a streak along an edge of the scene.
Polygon blob(const Eigen::Vector2d& centre_px, double half_px, double grey, std::mt19937_64& random);
Polygon streak(const GapScene& scene, bool frame, double from_mm, double to_mm, double off_mm,
               double width_mm, double grey);

}  // namespace zeropose::test
