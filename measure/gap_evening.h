// The shift and turn of a pane in its plane that evens the gaps round it (spec 70, pane-gaps).
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "calib/rigid.h"
#include "measure/code.h"

namespace zeropose {

// A gap at the pane's rim, in the pane's frame T whose x and y lie in its plane.
struct PaneGap {
  std::string name;
  Eigen::Vector2d p_T_mm = Eigen::Vector2d::Zero();
  // From the pane to the frame: a unit vector, or its part in the plane where the gap is inclined to it.
  Eigen::Vector2d outward_T = Eigen::Vector2d::Zero();
  double gap_mm = 0, sigma_mm = 0;  // sigma > 0
  double weight = 1;                // the user's, 0..1
  double wanted_mm = 0;             // absolute, or by how much wider than the common gap
};

struct EveningProblem {
  std::span<const PaneGap> gaps;
  bool even = true;           // to one gap, whatever it is; else to the wanted gaps
  double shape_sigma_mm = 0;  // of what pane and frame deviate from their drawings at a gap
  double tolerance_mm = 0.1;  // gaps that deviate by no more need no motion
  double max_x_mm = 0, max_y_mm = 0, max_rz_rad = 0;  // largest motion of the pane either way
};

struct EveningResult {
  Code code = Code::internal;
  std::string reason;             // one sentence with the numbers, empty when ok
  bool even_already = false;      // within the tolerance: the motion and all sigmas are zero
  Pose X_TTn = Pose::Identity();  // the moved pane in the pane's frame: x, y and rz, to be done by the hand
  double x_mm = 0, y_mm = 0, rz_rad = 0;                 // the same
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();  // of x, y (mm), rz (rad), from the gaps' sigmas
  double common_mm = 0, common_sigma_mm = 0;             // even: the gap that all will have; else 0
  double worst_mm = 0;                                   // largest deviation from even or wanted as measured
  std::vector<double> predicted_mm;  // the gaps after the motion, in the order of the problem
  double predicted_worst_mm = 0;  // largest deviation then; above the tolerance the shapes do not allow more
  int redundancy = 0;
  std::vector<std::size_t> removed;   // gaps that contradict the others, worst first
  std::vector<std::size_t> suspects;  // deviation_not_attributable: one of these
};

// With the motion (t, rz) the gap at p becomes g - outward . (t + rz x p), and to all orders where the frame
// is straight and, once the gaps are even, parallel to the pane's edge. Minimised is the sum of weight /
// variance (gap after the motion - wanted - m)^2, variance = sigma^2 + shape_sigma^2; the common gap m is
// free where the gaps are to be even, else 0. Needs as many gaps as there are unknowns, 4 or 3, and checks
// itself with one more; a gap of weight 0 is only predicted. Where the gaps are even within the
// tolerance it is not asked whether they agree to their sigmas. A gap that contradicts the others is taken
// out as in remove_wrong_points(), which two gaps more than unknowns allow.
//
// Codes: argument_out_of_range (of the problem's limits), marks_invalid (a number of a gap that is none, a
// sigma or weight out of range, an outward that is longer than 1), too_few_marks, geometry_degenerate (a
// motion that changes the gaps by less than evening_least_effect of it, named), deviation_not_attributable,
// limit_x, limit_y, limit_rz (the motion is beyond its limit; it is reported and not shortened). The motion
// counts only when the code is ok.
inline constexpr double evening_least_effect = 0.02;
EveningResult even_gaps(const EveningProblem& problem);

}  // namespace zeropose
