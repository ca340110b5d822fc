// A press shop as tests see it: two cameras above a conveyor look at the holes of a sheet of 4200 x 1900 mm
// that lies on it (spec 70). The plane of the conveyor is none of the world's.
#pragma once

#include <vector>

#include "tests/support/cell_scene.h"

namespace zeropose::test {

inline const Eigen::Vector3d sheet_ends_O_mm[] = {{0, 0, 0}, {4200, 0, 0}, {0, 1900, 0}, {4200, 1900, 0}};

// Straight above a point of the conveyor, 2500 mm high, a camera with a field of 2460 x 1970 mm.
inline CalibratedCamera camera_above(const std::string& name, const Pose& X_WP, double x_mm, double y_mm) {
  CalibratedCamera camera;
  camera.name = name;
  camera.model = {1280, 1024, 1300, 1300, 636, 515, Division{3e-8}};
  camera.X_WC = X_WP * from_six_numbers({x_mm, y_mm, 2500, 180, 0, 0});
  return camera;
}

inline void add_hole(Job& job, std::size_t camera, const std::string& name, double x_mm, double y_mm) {
  job.views.push_back({camera, job.marks.size()});
  Mark& hole = job.marks.emplace_back();
  hole.name = name;
  hole.p_O_mm = {x_mm, y_mm, 0};
  hole.normal_O = Eigen::Vector3d::UnitZ();
  hole.radius_mm = 22;
  hole.tolerance_px = 1.5;
}

inline CellScene sheet_scene() {
  const Pose X_WP = from_six_numbers({800, -450, 820, 1.5, -2.5, 20});
  CellScene scene;
  scene.cameras = {camera_above("left", X_WP, 1000, 950), camera_above("right", X_WP, 3200, 950)};
  Job& job = scene.job;
  job.name = "sheet";
  job.X_WP_planar = X_WP;
  job.X_WO_nominal = X_WP * from_six_numbers({20, -10, 0, 0, 0, 0.5});
  job.search_mm = 130;
  job.system_sigma_px = 0.1;
  add_hole(job, 0, "left/1", 300, 300);
  add_hole(job, 0, "left/2", 300, 1600);
  add_hole(job, 0, "left/3", 1600, 950);
  add_hole(job, 1, "right/1", 3900, 300);
  add_hole(job, 1, "right/2", 3900, 1600);
  add_hole(job, 1, "right/3", 2600, 950);
  for (const Eigen::Vector3d& end : sheet_ends_O_mm)
    job.application_points.push_back({"end " + std::to_string(job.application_points.size() + 1), end});
  job.requirements.min_marks = 2;
  job.requirements.max_sigma_mm = 2;
  job.requirements.max_compensation_mm = 40;  // 4.5 px of the image origin are 9 mm down there
  for (std::size_t axis = 0; axis < 6; ++axis) job.requirements.limits[axis] = {-100, 100};
  return scene;
}

// X_O0O of a sheet that lies elsewhere on the conveyor.
inline Pose random_sheet_shift(Random& random, double mm, double deg) {
  return from_six_numbers(
      {uniform(random, -mm, mm), uniform(random, -mm, mm), 0, 0, 0, uniform(random, -deg, deg)});
}

// How far a robot that applies the measured motion misses an end of the sheet, mm: the largest of all ends.
inline double worst_end_mm(const Pose& D_W_measured, const Pose& X_WO0_true, const Pose& X_WO_true) {
  double worst = 0;
  for (const Eigen::Vector3d& p_O : sheet_ends_O_mm)
    worst = std::max(worst, (D_W_measured * (X_WO0_true * p_O) - X_WO_true * p_O).norm());
  return worst;
}

}  // namespace zeropose::test
