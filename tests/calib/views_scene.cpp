#include "views_scene.h"

#include "tests/support/synthetic_camera.h"

namespace zeropose::test {

using Eigen::Vector2d;
using Eigen::Vector3d;

Vector2d independent_pixel(const CameraModel& camera, const Vector3d& p_CQ_mm) {
  return photograph(camera, Pose::Identity(), p_CQ_mm);
}

CameraModel camera_with(const Distortion& lens) { return {1280, 1024, 1503.2, 1498.7, 645.3, 498.1, lens}; }

std::vector<Vector3d> board(int count, double pitch_mm, double depth_mm) {
  Random random(5);
  std::vector<Vector3d> points;
  for (int row = 0; row < count; ++row)
    for (int col = 0; col < count; ++col)
      points.emplace_back(col * pitch_mm, row * pitch_mm, depth_mm > 0 ? uniform(random, 0, depth_mm) : 0);
  return points;
}

ViewsScene scene_at(const std::vector<CameraModel>& models, const std::vector<Pose>& X_WC,
                    const std::vector<Vector3d>& points, const std::vector<Pose>& X_WB) {
  ViewsScene scene;
  scene.models = models, scene.X_WC = X_WC, scene.X_WB = X_WB;
  for (std::size_t c = 0; c < models.size(); ++c) {
    ViewsCamera camera;
    camera.name = "camera" + std::to_string(c + 1);
    camera.width_px = models[c].width_px, camera.height_px = models[c].height_px;
    const bool brown = std::holds_alternative<BrownConrady>(models[c].distortion);
    camera.lens = brown ? LensModel::brown : LensModel::division;
    scene.cameras.push_back(camera);
  }
  for (std::size_t v = 0; v < X_WB.size(); ++v) {
    scene.views.push_back({std::to_string(v + 1), std::nullopt});
    for (std::size_t c = 0; c < models.size(); ++c)
      for (const Vector3d& p : points) {
        ViewPoint seen{v, c, {}};
        seen.point.p_W_mm = p;
        seen.point.u_px = independent_pixel(models[c], X_WC[c].inverse() * X_WB[v] * p);
        scene.points.push_back(seen);
      }
  }
  return scene;
}

ViewsScene scene_of(const std::vector<CameraModel>& models, const std::vector<Pose>& X_WC,
                    const std::vector<Vector3d>& points, std::size_t views, double tilt_deg, Random& random) {
  Vector3d middle = Vector3d::Zero();
  for (const Vector3d& p : points) middle += p / static_cast<double>(points.size());
  std::vector<Pose> X_WB;
  for (std::size_t v = 0; v < views; ++v) {
    const double rx = uniform(random, -tilt_deg, tilt_deg), ry = uniform(random, -tilt_deg, tilt_deg);
    X_WB.push_back(from_six_numbers({0, 0, 0, rx, ry, uniform(random, -180, 180)}));
    const Vector3d at(uniform(random, -100, 100), uniform(random, -80, 80), uniform(random, 700, 900));
    X_WB.back().translation() = at - X_WB.back().linear() * middle;
  }
  return scene_at(models, X_WC, points, X_WB);
}

void add_noise(ViewsScene& scene, double sigma_px, Random& random) {
  for (ViewPoint& seen : scene.points)
    seen.point.u_px += Vector2d(normal(random, sigma_px), normal(random, sigma_px));
}

}  // namespace zeropose::test
