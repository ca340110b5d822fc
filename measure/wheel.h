// Camber and toe of a wheel from lines of light on its tyre (spec 70, wheel-alignment).
#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "calib/camera_model.h"
#include "measure/line_array.h"
#include "measure/tyre_profile.h"
#include "measure/wheel_plane.h"
#include "measure/wheel_task.h"

namespace zeropose {

// Two cameras and a projector that look at a part of the side wall. The projector need not be calibrated.
struct WheelSensor {
  std::string name;
  double angle_rad = 0;  // of its middle radial line, about z of W from x to y
  CalibratedCamera left, right;
  ImageView left_image, right_image;
};

struct WheelProblem {
  std::span<const WheelSensor> sensors;  // three
  LineLayout layout;
  LightLineSearch search;
  ExpectedTyre tyre;
  // The nominal wheel: z its axis. Camber and toe are about axes with rz = 0 in W, so x of W must point
  // forward and y up as well: look_at_wheel() gives all cameras in the nominal wheel's frame.
  Pose X_WN = Pose::Identity();
  double max_tilt_rad = 0.09, max_shift_mm = 25;  // of the wheel from there
  std::optional<Pose> X_WO0;                      // the zero wheel, as measured; none: X_WN
};

enum class WheelStatus {
  failed = 0,
  ok,
  wrong_problem,      // sensors, images or numbers that make no sense
  lines_not_ordered,  // in one image: order says why
  pairs_disagree,     // a crossing of the left image does not belong to that of the right one
  line_too_short,     // too few points along a radial line
  no_axis,            // the lines show no common section of a tyre
  no_common_profile,  // no heave or hollow on all nine lines
  contradiction,      // one of the nine points disagrees with the others
  axis_disagrees,     // the nine points' axis is not that of the whole side wall
  out_of_range        // tilted or shifted more than expected
};
std::string_view name_of(WheelStatus status);

struct WheelResult {
  WheelStatus status = WheelStatus::failed;
  LineArrayStatus order = LineArrayStatus::failed;  // ok unless lines_not_ordered
  std::string reason;                               // one sentence: which sensor, camera, line; empty when ok
  Pose X_WO = Pose::Identity();                     // see wheel_frame()
  double camber_rad = 0, toe_rad = 0;               // against zero
  double sigma_camber_rad = 0, sigma_toe_rad = 0;   // of this measurement, from noise alone
  double profile_radius_mm = 0;
  SharedProfile profile;  // nine points: left, middle, right of the first sensor and so on
  WheelPlaneResult plane;
  double surface_differs_rad = 0;  // angle between the axis and that of the whole side wall
  std::vector<SideLine> lines;     // nine, in the same order
};

// 1. In each image the lines are found and ordered. 2. Crossings of left and right are triangulated as pairs:
// wrong pairs do not meet. 3. Every radial line becomes points on the side wall. 4. The axis about which all
// nine show the same section is the start. 5. Heaves and hollows along that axis by splines; of those that
// all nine lines have in common the sharpest counts. 6. Plane and circle through its nine points give the
// axis, along which the heights are taken next: until it settles.
//
// Numbers are filled in as far as they are known, whatever the status; they count only when it is ok.
WheelResult measure_wheel(const WheelProblem& problem);

// How the lines are looked for in the image of one camera, of a sensor at that angle. nullopt: the camera
// does not see the nominal side wall there.
std::optional<LineArrayProblem> line_array_problem(const WheelProblem& problem, double angle_rad,
                                                   const CalibratedCamera& camera, const ImageView& image);

}  // namespace zeropose
