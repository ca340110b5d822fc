// A calibration body in an image: planes with circle marks, found and numbered (spec 40 P3).
#pragma once

#include <Eigen/Core>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "calib/camera_model.h"
#include "measure/image.h"

namespace zeropose {

struct BodyMark {
  std::string name;
  Eigen::Vector3d p_B_mm = Eigen::Vector3d::Zero();
  double radius_mm = 0;  // 0: unknown
  // Of its plane, towards the side from which it can be seen, any length; zero: from the layout, either side.
  Eigen::Vector3d normal_B = Eigen::Vector3d::Zero();
};

// What is known of the camera: all of its internals about right, or a focal length within 20 %, or nothing.
struct BodyProblem {
  std::span<const BodyMark> marks;
  std::optional<CameraModel> camera;
  double focal_px = 0;          // without a camera; 0: unknown
  double least_share = 0.3;     // of the marks, that must be found
  double min_diameter_px = 6;   // of a mark's longer axis
  double min_axis_ratio = 0.2;  // of a mark: about 0.2 at a tilt of 78 degrees
  double min_contrast = 15;     // grey levels
};

struct BodyPoint {
  std::size_t mark = 0;                            // index into the marks
  Eigen::Vector2d u_px = Eigen::Vector2d::Zero();  // centre of its image, not the image of its centre
  Eigen::Matrix2d covariance_px2 = Eigen::Matrix2d::Zero();
  double diameter_px = 0;                              // longer axis
  Eigen::Vector2d dev_px = Eigen::Vector2d::Zero();    // found - where the rough camera expects it
  Eigen::Vector3d normal_B = Eigen::Vector3d::Zero();  // unit, towards the camera
};

enum class BodyStatus {
  failed = 0,
  found,
  wrong_problem,
  empty_image,
  no_layout,     // the table has no plane with rows and columns
  no_numbering,  // no reading explains more than a few discs
  too_few,
  ambiguous,   // another numbering explains about as many discs
  mirrored,    // the table's coordinates are left-handed
  from_behind  // the marks' normals point away from the camera
};
std::string_view name_of(BodyStatus status);

// Points are given only when the body was found, in the order of the marks.
struct BodyResult {
  BodyStatus status = BodyStatus::failed;
  std::string reason;  // one sentence with the numbers; empty when all marks were found
  std::vector<BodyPoint> points;
  std::vector<std::size_t> missing;  // marks
  std::size_t discs = 0;             // round things in the image
  std::size_t explained = 0;         // of them by the best numbering
  std::size_t next_best = 0;         // by the best one that gives discs other numbers
  bool dark_on_light = false;
  // Good enough to know where a mark is expected, and nothing else.
  CameraModel rough_model;
  Pose X_CB = Pose::Identity();
  double rms_px = 0;  // root of the mean squared point distance
};

// Pure and repeatable bit by bit. Each plane needs rows and columns, so that four neighbours form about a
// parallelogram; they need not be regular, and the planes may stand at any angle. Such a parallelogram in the
// image and in the table is a hypothesis, which grows over its plane by a homography and then over all planes
// by a rough camera whose focal length, origin and lens may give way. The best reading must explain clearly
// more discs than the best one with other numbers, else the answer is `ambiguous`: never a guess. Cut, half
// hidden or false discs are left out.
BodyResult find_body(const ImageView& image, const BodyProblem& problem);

}  // namespace zeropose
