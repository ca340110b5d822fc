// Pictures of the published calibration body with known truth: outlines through a camera that does not share
// project() with the code under test (synthetic_camera.h), painted by mark_picture.h.
#pragma once

#include <Eigen/Core>
#include <random>
#include <set>
#include <vector>

#include "calib/calibration.h"
#include "measure/body.h"
#include "tests/support/mark_picture.h"

namespace zeropose::test {

// The 44 marks of Table 4.5, with this radius; normals only on demand.
std::vector<BodyMark> published_body(double radius_mm, bool with_normals);

// Into the corner of the three planes, towards the camera.
Eigen::Vector3d body_normal(const BodyMark& mark);

struct BodyScene {
  CameraModel camera{768, 572, 4235.24, 4227.56, 416.04, 332.77, Division{-0.010727}};
  Pose X_CB = Pose::Identity();
  double radius_mm = 8;
  double surface = 170, print = 55, surroundings = 120;  // grey levels
  double noise_grey = 1.5;
  std::set<std::size_t> hidden;  // marks, from 0
  int false_discs = 0;           // round dark things, some on the walls, some beside
  std::uint64_t seed = 1;

  std::vector<BodyMark> marks() const { return published_body(radius_mm, false); }
  Eigen::Vector2d centre_px(const BodyMark& mark) const;
  // Nothing of it is cut off or nearly so.
  bool is_inside(const BodyMark& mark) const;
};

// The camera looks at the body's middle from this direction (B), turned about its axis.
Pose looking_at_body(const Eigen::Vector3d& from_B, double distance_mm, double roll_deg);

Pixels photograph(const BodyScene& scene);

}  // namespace zeropose::test
