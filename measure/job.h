// What is measured: marks on an object, which camera sees which, and what a result must fulfil (spec 50).
#pragma once

#include <Eigen/Core>
#include <array>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "calib/camera_model.h"
#include "measure/gap_task.h"
#include "measure/marks.h"
#include "measure/wheel_task.h"

namespace zeropose {

inline constexpr double no_tolerance = std::numeric_limits<double>::infinity();

// A mark on the object.
struct Mark {
  std::string name;
  MarkKind kind = MarkKind::disc;
  bool bright = false;                                 // brighter than what surrounds it
  Eigen::Vector3d p_O_mm = Eigen::Vector3d::Zero();    // its centre
  Eigen::Vector3d normal_O = Eigen::Vector3d::Zero();  // of its plane, towards the camera; zero: unknown
  double radius_mm = 0;                    // of its outline; 0: unknown; then no eccentricity correction
  std::vector<double> inner_radii_mm{};    // of a ring's further circles, descending
  std::vector<Eigen::Vector3d> edges_O{};  // unit; of a corner: along its two edges, away from it
  double weight = 1;                       // the user's factor 0..1; 0: only its deviation is reported
  double tolerance_px = no_tolerance;      // largest deviation
  double tolerance_mm = no_tolerance;
  double sigma_mm = 0;  // non-rigidity of the place it sits on
};

// Camera and mark are indices into the cell's cameras and the job's marks. After the cell's cameras come
// those on a robot's hand: of each of the job's positions one after the other (HandEye).
struct View {
  std::size_t camera = 0;
  std::size_t mark = 0;
};

struct ApplicationPoint {
  std::string name;
  Eigen::Vector3d p_O_mm = Eigen::Vector3d::Zero();
};

// From where cameras on a robot's hand look at the object, all at once (spec 50 M3, virtual cameras).
struct HandPosition {
  std::string name;
  std::vector<std::size_t> cameras{};  // of the cell, on one hand; two are a stereo sensor
  Pose X_RH = Pose::Identity();        // as taught
  double tolerance_mm = 1;             // how far from there the hand may stand
  double tolerance_deg = 0.5;
};

struct Range {
  double min = 0, max = 0;
};

// What X_O0O and its estimate must fulfil (M6.2, M6.4, M6.5, M6.6). Limits: x y z in mm, rx ry rz in degrees.
struct Requirements {
  int min_marks = 3;
  int min_marks_per_camera = 0;  // in every camera of the job
  int min_cameras = 1;
  double max_sigma_mm = 0;   // at every application point, one sigma of the largest direction; 0: not checked
  double max_hidden_mm = 0;  // what one wrong mark may do at an application point unnoticed; 0: not checked
  double max_compensation_mm = 5;
  double max_displacement_mm = 0;  // of every application point by X_O0O; 0: not checked
  double max_step_mm = 0;          // of every application point since the last valid result; 0: not checked
  double max_step_deg = 0;         // of the object's rotation since then; 0: not checked
  std::array<Range, 6> limits{};
};

struct Job {
  std::string name;
  int number = 0;  // as the robot selects it
  std::vector<Mark> marks;
  std::vector<View> views;
  Pose X_WO_nominal =
      Pose::Identity();  // where the object stops ideally, before a zero measurement says it better
  std::optional<Pose> X_WP_planar{};  // a sheet: only x, y, rz in this plane of the world are free, O lies in
                                      // it with its z axis across
  std::vector<HandPosition> positions{};
  double positions_within_s = 60;  // from the first position to the measurement
  double search_mm = 0;            // search areas reach this far round the expected place
  double system_sigma_px = 0;      // calibration errors that remain after zero (M6.3)
  std::vector<ApplicationPoint> application_points;
  Requirements requirements;
  // One of these in a job without marks and positions:
  std::optional<GapTask> gaps{};     // it needs no zero measurement
  std::optional<WheelTask> wheel{};  // of X_O0O there are the shifts and the tilts, camber rx and toe ry
};

// A camera at one of the job's positions.
struct HandEye {
  std::size_t position = 0, camera = 0;
};

// All of them, as View::camera counts them after the cell's cameras.
inline std::vector<HandEye> hand_eyes(const Job& job) {
  std::vector<HandEye> eyes;
  for (std::size_t i = 0; i < job.positions.size(); ++i)
    for (const std::size_t camera : job.positions[i].cameras) eyes.push_back({i, camera});
  return eyes;
}

// The camera of the cell that takes the picture of a view, for a cell of so many cameras.
inline std::size_t device_of(const Job& job, std::size_t view_camera, std::size_t cell_cameras) {
  return view_camera < cell_cameras ? view_camera : hand_eyes(job).at(view_camera - cell_cameras).camera;
}

// The cameras that the job's views, gaps or wheel name, as View::camera counts them; some more than once.
inline std::vector<std::size_t> cameras_of(const Job& job) {
  std::vector<std::size_t> cameras;
  for (const View& view : job.views) cameras.push_back(view.camera);
  if (job.gaps)
    for (const GapView& gap : job.gaps->gaps) cameras.push_back(gap.camera);
  if (job.wheel)
    for (const WheelEyes& eyes : job.wheel->sensors) cameras.insert(cameras.end(), {eyes.left, eyes.right});
  return cameras;
}

// Fewer marks fix no pose, whatever the requirements say.
inline int least_marks(const Job& job) { return job.X_WP_planar ? 2 : 3; }

}  // namespace zeropose
