// Internals from the vanishing points of a rectangle or square in several images (spec 30 C4). Without
// distortion; for a quick look.
#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "calib/camera_model.h"
#include "calib/parameters.h"

namespace zeropose {

// Where the images of two perpendicular directions meet their parallels.
struct VanishingPair {
  Eigen::Vector2d v1_px = Eigen::Vector2d::Zero(), v2_px = Eigen::Vector2d::Zero();
};

// What is given decides what is found:
//   nothing:       fx fy cx cy from 4 pairs and more, fx = fy cx cy from 3 or with one_focal
//   origin_px:     fx fy from 2 pairs and more, fx = fy from one pair or with one_focal
//   focal_px:      cx cy from 2 pairs and more
struct VanishingProblem {
  std::span<const VanishingPair> pairs;
  std::optional<Eigen::Vector2d> origin_px = std::nullopt;
  std::optional<Eigen::Vector2d> focal_px = std::nullopt;  // fx, fy
  // About where the origin lies. Two pairs and the focal lengths leave two origins: the nearer one is taken.
  std::optional<Eigen::Vector2d> near_px = std::nullopt;
  bool one_focal = false;
  double max_px = 0;  // pairs with a vanishing point farther from pixel (0, 0) are skipped; 0: none
};

// Every one but ok comes with a reason and without numbers.
enum class VanishingStatus {
  failed = 0,
  ok,
  wrong_problem,
  not_finite,
  too_few_pairs,
  ambiguous,       // two origins fit: near_px decides
  not_determined,  // the poses are too alike
  no_camera        // the numbers contradict: a squared focal length would not be positive
};

struct SkippedPair {
  std::size_t index = 0;
  std::string reason;
};

struct VanishingResult {
  VanishingStatus status = VanishingStatus::failed;
  std::string reason;
  double fx_px = 0, fy_px = 0, cx_px = 0, cy_px = 0;  // given ones as given
  ParameterSet estimated;
  double condition = 0;  // of the equations, columns scaled to length 1
  std::vector<std::size_t> used;
  std::vector<SkippedPair> skipped;
};

VanishingResult calibrate_by_vanishing_points(const VanishingProblem& problem);

// A rectangle's corners A B C D in its order, in one image.
using RectangleCorners = std::array<Eigen::Vector2d, 4>;

struct RectanglePair {
  std::optional<VanishingPair> pair;
  bool from_diagonals = false;
  std::string reason;  // why there is none
};

// V1 = AB x CD and V2 = AD x BC. Where one of them lies at infinity or farther than max_px (0: no limit) from
// pixel (0, 0), the diagonals of a square give a pair instead. None when that fails too: the plane is
// parallel to the chip, or a rectangle's sides are parallel in the image.
RectanglePair vanishing_pair(const RectangleCorners& corners_px, bool square, double max_px);

struct RectangleSize {
  double ratio = 1;    // AD / AB
  double side_mm = 1;  // AB
};

struct RectanglePose {
  // O: origin in A, x along AB, y along AD.
  std::optional<Pose> X_CO;
  std::string reason;
  double ratio_seen = 0;  // AD / AB as this camera sees it: a check of camera and size
  double rms_px = 0;      // of the four corners projected with X_CO
};

// In closed form from the four corners (spec 30 C4).
RectanglePose rectangle_pose(const CameraModel& camera, const RectangleCorners& corners_px,
                             const RectangleSize& size);

}  // namespace zeropose
