// What a job measures that evens the gaps round a pane instead of looking at marks (spec 70, pane-gaps).
#pragma once

#include <string>
#include <vector>

#include "calib/rigid.h"
#include "measure/gap.h"

namespace zeropose {

// One gap and the camera on the hand that looks at it.
struct GapView {
  std::string name;
  std::size_t camera = 0;  // of the cell, on the hand that carries the pane
  GapSearch search;
  GapPlane plane;        // in H: that of both edges, for a flat pane z = 0 of T
  double weight = 1;     // the user's, 0..1; 0: the gap is only reported
  double wanted_mm = 0;  // absolute, or by how much wider than the common gap
};

struct GapTask {
  std::vector<GapView> gaps;
  Pose X_HT = Pose::Identity();  // the pane in the hand: x and y lie in its plane; the robot's tool
  bool even = true;              // to one gap, whatever it is; else to the wanted gaps
  int min_gaps = 0;              // of a weight above 0 that must be measured and agree
  double shape_sigma_mm = 0.1;   // by how much pane and frame deviate from their drawings at a gap
  double tolerance_mm = 0.05;    // gaps that deviate by no more need no motion
  double max_sigma_mm = 0.05;    // of the motion at any gap, one sigma
  double max_x_mm = 0, max_y_mm = 0, max_rz_rad = 0;  // largest motion either way, of one answer
};

}  // namespace zeropose
