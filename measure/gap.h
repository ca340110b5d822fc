// The gap between a pane that the hand holds and the frame round it, in the image of one camera on that hand
// (spec 70, pane-gaps).
#pragma once

#include <Eigen/Core>
#include <string>
#include <string_view>

#include "calib/camera_model.h"
#include "measure/image.h"
#include "measure/marks.h"

namespace zeropose {

// The sense of an edge along the direction of the search.
enum class EdgeSense { dark_to_bright, bright_to_dark };

// Where in the image the gap is expected: a window whose one axis crosses the gap from the frame to the pane.
struct GapSearch {
  Eigen::Vector2d centre_px = Eigen::Vector2d::Zero();  // the gap is measured here
  double direction_rad = 0;                      // across the edges in the image, from the frame to the pane
  double half_across_px = 0, half_along_px = 0;  // of the window, along that direction and across it
  EdgeSense frame = EdgeSense::bright_to_dark, pane = EdgeSense::dark_to_bright;
  double min_gap_mm = 0, max_gap_mm = 0;  // 0 < min < max
  double direction_tolerance_rad = 0.2;   // of either edge
  double max_wedge_rad = 0.05;            // between the edges
  double min_length_share = 0.3;          // of 2 half_along_px that is seen of an edge
  double min_contrast = 15;               // grey levels
  double max_blur_px = 4;
};

// The plane that both edges lie in.
struct GapPlane {
  Eigen::Vector3d p_H_mm = Eigen::Vector3d::Zero();  // any point of it
  Eigen::Vector3d n_H = Eigen::Vector3d::Zero();     // its normal, of any length and either sense
};

struct GapProblem {
  CalibratedCamera camera;  // on the hand: its X_WC is X_HC
  GapPlane plane;
  GapSearch search;
  ImageView image;
};

enum class GapStatus {
  failed = 0,
  ok,
  wrong_problem,   // a number that is none, a plane that is not seen
  outside_image,   // the window
  edge_not_found,  // one of both, or it is saturated, or fits its pixels badly (quality below 0.7)
  low_contrast,    // one of both
  ambiguous,       // several pairs of edges may be the gap
  outside_window,  // an edge passes beside the window
  not_parallel,    // the wedge is larger than its limit
  overlap,         // the pane's edge lies on the frame's side of the frame's edge
  out_of_range     // the gap is narrower or wider than expected
};
std::string_view name_of(GapStatus status);

// In the image and on the plane.
struct GapEdge {
  MarkFinding finding;  // u_px: its point nearest to the window's centre; or what came nearest to an edge
  Eigen::Matrix2d line_covariance = Eigen::Matrix2d::Zero();  // across at u_px (px), of its direction (rad)
  Eigen::Vector3d p_H_mm = Eigen::Vector3d::Zero();           // where the gap is measured
  Eigen::Vector3d along_H = Eigen::Vector3d::Zero();          // unit vector, the same sense for both edges
};

struct GapResult {
  GapStatus status = GapStatus::failed;
  std::string reason;  // one sentence with the numbers, empty when ok
  GapEdge frame, pane;
  double gap_mm = 0;  // from the frame's edge to the pane's, along -outward_H through the window's centre
  double sigma_mm = 0;
  double wedge_rad = 0;  // turn from the frame's edge to the pane's; positive: the gap widens along along_H
  double wedge_sigma_rad = 0;
  Eigen::Vector3d outward_H =
      Eigen::Vector3d::Zero();  // unit vector in the plane, from the pane to the frame
};

// Both edges are found and fitted as marks of the kind edge, all of them that stand in the box round the
// window; the pair counts whose gap and wedge lie within the limits. A second such pair is ambiguous when its
// weaker edge has more than half of the contrast times length of the best pair's weaker edge, also where an
// edge of the second one was seen and not fitted: dirt on the right edge does not let a wrong one pass. The
// gap is measured across the mean direction of both edges. Sigmas: from both edges' covariances, through lens
// and plane, larger by the share of an edge that could not be used; the plane and the calibration count as
// known (an error of the camera's distance by one percent is one percent of the gap). Between the edges there
// are at least 10 px. Numbers are filled in as far as they are known, whatever the status; they count only
// when it is ok.
GapResult measure_gap(const GapProblem& problem);

}  // namespace zeropose
