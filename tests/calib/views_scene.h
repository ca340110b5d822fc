// Boards before cameras, for the tests and the benchmark of calibrate_views(). Pixels do not come from
// project(): Brown's from OpenCV, the division model's from a bisection of (E1).
#pragma once

#include <string>
#include <vector>

#include "calib/views.h"
#include "tests/support/poses.h"

namespace zeropose::test {

struct ViewsScene {
  std::vector<ViewsCamera> cameras;
  std::vector<BoardView> views;
  std::vector<ViewPoint> points;
  // Truth.
  std::vector<CameraModel> models;
  std::vector<Pose> X_WC, X_WB;

  ViewsProblem problem() const {
    ViewsProblem given;
    given.cameras = cameras, given.views = views, given.points = points;
    return given;
  }
};

// A lens as wide as its camera's: 1280 x 1024 px, f about 1500 px.
CameraModel camera_with(const Distortion& lens);

Eigen::Vector2d independent_pixel(const CameraModel& camera, const Eigen::Vector3d& p_CQ_mm);

// count x count points, pitch_mm apart, in z = 0, or with some depth: every point by up to depth_mm.
std::vector<Eigen::Vector3d> board(int count, double pitch_mm, double depth_mm = 0);

// Boards of `points` at X_WB, their poses unknown, seen by every camera.
ViewsScene scene_at(const std::vector<CameraModel>& models, const std::vector<Pose>& X_WC,
                    const std::vector<Eigen::Vector3d>& points, const std::vector<Pose>& X_WB);

// Boards of `points` about 800 mm before the first camera, tilted by up to tilt_deg about both axes, seen by
// every camera.
ViewsScene scene_of(const std::vector<CameraModel>& models, const std::vector<Pose>& X_WC,
                    const std::vector<Eigen::Vector3d>& points, std::size_t views, double tilt_deg,
                    Random& random);

void add_noise(ViewsScene& scene, double sigma_px, Random& random);

}  // namespace zeropose::test
