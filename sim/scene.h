// What is true about a simulated cell: its cameras, the marks on the object and how the picture looks.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <variant>
#include <vector>

#include "calib/camera_model.h"
#include "config/cell.h"
#include "measure/job.h"
#include "sim/gap_object.h"
#include "sim/wheel_object.h"

namespace zeropose {

// What the object looks like: one of these.

// A car body: discs, each on a plate of its own, before an underbody.
struct PlatesObject {};

// A steel sheet on a conveyor: the polygon in z = 0 of O, with the job's discs as holes and its corners among
// the polygon's. z points to the cameras.
struct SheetObject {
  std::vector<Eigen::Vector2d> outline_mm;
};

// A plate that is lit from behind, across to O's z axis, which points to the camera. The job's balls stand
// before it on glass pins.
struct BallPlateObject {
  Eigen::Vector3d middle_O_mm = Eigen::Vector3d::Zero();
  Eigen::Vector2d size_mm = Eigen::Vector2d::Zero();
};

using ObjectTruth = std::variant<PlatesObject, SheetObject, BallPlateObject, GapsObject, WheelObject>;

// Grey levels are those at the middle of the picture, where the illumination is 1.
struct PictureSettings {
  double surface_grey = 165;           // of what the marks sit on; each plate differs by a few per cent
  double mark_grey = 60;               // of dark marks; a bright one has the surface's grey, its plate this
  double illumination_gradient = 0.3;  // change over the picture's diagonal, relative
  double blur_sigma_px = 0.7;          // Gaussian
  double noise_sigma_grey = 2;
  int clutter = 12;  // per camera, at most: what finds no place clear of the marks is left out
  std::uint64_t seed = 1;
};

// A camera that a robot carries: it stands at X_WR X_RH X_HC.
struct HandCamera {
  std::size_t camera = 0, robot = 0;  // of the cell
  Pose X_WR = Pose::Identity(), X_HC = Pose::Identity();
};

// The true cameras, in the order of the cell's cameras, the job's marks and views, and the cell's reference
// points as marks of the world.
struct Scene {
  std::vector<CalibratedCamera> cameras;  // one on a hand: where it is at the job's first position
  std::vector<HandCamera> hand_cameras;
  std::vector<Mark> marks;
  std::vector<View> views;  // cameras of the cell, whatever position they look from
  std::vector<Mark> fixed_marks;
  std::vector<View> fixed_views;
  Pose X_WO_nominal = Pose::Identity();
  ObjectTruth object;
  PictureSettings picture;
};

// Those of the marks that a camera sees.
std::vector<Mark> marks_seen(const std::vector<Mark>& marks, const std::vector<View>& views,
                             std::size_t camera);

// What is wrong with marks and cameras for a while.
struct Faults {
  std::set<std::string> covered;                // names of marks and reference points that are hidden
  std::map<std::string, double> displaced_px;   // marks that sit off their place: by so much to the right in
                                                // the image, at the same distance
  std::map<std::string, Pose> moved_cameras{};  // X_CoCn by the camera's name
};

// The scenes of the cell's jobs with the truth of the file CELL.sim.json. Throws ConfigError: names file and
// key path of every mistake, also cameras that only one of both knows.
std::vector<Scene> load_scenes(const Cell& cell, const std::filesystem::path& sim_file);

// That of the first job.
Scene load_scene(const Cell& cell, const std::filesystem::path& sim_file);

}  // namespace zeropose
