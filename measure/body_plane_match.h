// One plane of a calibration body over the discs of an image. Internal to the room.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <span>
#include <vector>

#include "measure/body_layout.h"
#include "measure/lattice.h"

namespace zeropose {

// Seen through the stretch du/dplace (px per mm), is the outline about a circle? Its squared radius in mm^2,
// or nothing.
std::optional<double> round_radius2(const Eigen::Matrix2d& stretch, const Eigen::Matrix2d& shape_px2);

// Squared radii that may belong to equal discs.
bool alike_radius2(double a, double b);

struct PlaneMatch {
  std::size_t plane = 0;
  std::vector<std::size_t> disc_of;  // per mark of the plane, or no_disc
  std::size_t count = 0;
  double radius2_mm2 = 0;  // of the marks whose radius is not known
  // At the middle of the matched marks.
  Eigen::Vector2d middle_mm = Eigen::Vector2d::Zero(), middle_px = Eigen::Vector2d::Zero();
  Eigen::Matrix2d stretch = Eigen::Matrix2d::Identity();
};

// Readings of the discs as marks of a plane, grown from one parallelogram each by a homography; each once.
std::vector<PlaneMatch> match_planes(std::span<const LatticeDisc> discs, std::span<const BodyMark> marks,
                                     const BodyLayout& layout);

}  // namespace zeropose
