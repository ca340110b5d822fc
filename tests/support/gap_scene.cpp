#include "tests/support/gap_scene.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace zeropose::test {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double pi = 3.14159265358979323846;
constexpr int pieces = 24;  // of an edge, which the lens bends
constexpr double half_length_mm = 9, depth_mm = 6;

double between(double low, double high, std::mt19937_64& random) {
  return std::uniform_real_distribution<double>(low, high)(random);
}

// The division model, solved by hand: undistorted = distorted / (1 + K r^2).
Vector2d distorted(const Vector2d& x, double K) {
  const double r2 = x.squaredNorm();
  if (r2 == 0 || K == 0) return x;
  return x * ((1 - std::sqrt(1 - 4 * K * r2)) / (2 * K * r2));
}

// Half the wedge, to either side.
Vector2d on_edge(const GapScene& scene, bool frame, double along_mm, double beyond_mm) {
  const double side = frame ? -1 : 1;
  const double turn = -0.5 * side * scene.wedge_rad + (frame ? scene.frame_turn_rad : 0);
  const Vector2d at(side * 0.5 * scene.gap_mm - (frame ? scene.frame_off_mm : 0), 0);
  const Vector2d along(-std::sin(turn), std::cos(turn));
  return at + along_mm * along + beyond_mm * side * Vector2d(along.y(), -along.x());
}

Polygon body(const GapScene& scene, bool frame) {
  Polygon polygon{{}, frame ? scene.frame_grey : scene.pane_grey};
  const auto add = [&](double along_mm, double beyond_mm) {
    const Vector2d at = on_edge(scene, frame, along_mm, beyond_mm);
    polygon.corners_px.push_back(pixel_of(scene, at.x(), at.y()));
  };
  for (int k = 0; k <= pieces; ++k) add(half_length_mm * (2.0 * k / pieces - 1), 0);
  for (int k = pieces; k >= 0; --k) add(half_length_mm * (2.0 * k / pieces - 1), depth_mm);
  return polygon;
}

}  // namespace

CameraModel GapScene::model() const { return {240, 200, 2000, 2003, 118.4, 101.7, Division{lens_K}}; }

Vector3d GapScene::centre_C_mm() const {
  const CameraModel camera = model();
  const Vector2d d((centre_px.x() - camera.cx_px) / camera.fx_px,
                   (centre_px.y() - camera.cy_px) / camera.fy_px);
  const Vector2d x = d / (1 + lens_K * d.squaredNorm());
  return distance_mm * Vector3d(x.x(), x.y(), 1);
}

Eigen::Matrix3d GapScene::R_CG() const {
  const Vector3d about(std::cos(tilt_about_rad), std::sin(tilt_about_rad), 0);
  return exp_so3(tilt_rad * about) * exp_so3(turn_rad * Vector3d::UnitZ());
}

GapScene random_gap(std::mt19937_64& random) {
  GapScene scene;
  scene.gap_mm = between(3, 5, random);
  scene.wedge_rad = between(-0.02, 0.02, random);
  scene.turn_rad = between(-pi, pi, random);
  scene.tilt_rad = between(20, 40, random) * pi / 180;
  scene.tilt_about_rad = between(-pi, pi, random);
  scene.centre_px += Vector2d(between(-4, 4, random), between(-4, 4, random));
  scene.X_HC.linear() = exp_so3(Vector3d::NullaryExpr([&] { return between(-1.5, 1.5, random); }));
  scene.X_HC.translation() = Vector3d::NullaryExpr([&] { return between(-500, 500, random); });
  return scene;
}

Vector2d pixel_of(const GapScene& scene, double across_mm, double along_mm) {
  const CameraModel camera = scene.model();
  const Vector3d p = scene.centre_C_mm() + scene.R_CG() * Vector3d(across_mm, along_mm, 0);
  const Vector2d x = distorted(p.head<2>() / p.z(), scene.lens_K);
  return {camera.fx_px * x.x() + camera.cx_px, camera.fy_px * x.y() + camera.cy_px};
}

Vector2d edge_pixel(const GapScene& scene, bool frame, double along_mm) {
  const Vector2d at = on_edge(scene, frame, along_mm, 0);
  return pixel_of(scene, at.x(), at.y());
}

Picture paint(const GapScene& scene) {
  const CameraModel camera = scene.model();
  PolygonDrawing drawing;
  drawing.width_px = camera.width_px;
  drawing.height_px = camera.height_px;
  drawing.background = scene.gap_grey;
  drawing.polygons = {body(scene, true), body(scene, false)};
  drawing.polygons.insert(drawing.polygons.end(), scene.dirt.begin(), scene.dirt.end());
  drawing.blur_sigma_px = scene.blur_px;
  drawing.shading_per_px = scene.shading_per_px;
  return paint(drawing);
}

GapProblem problem_of(const GapScene& scene) {
  GapProblem problem;
  problem.camera = {"c1", scene.model(), scene.X_HC, true};
  const Eigen::Matrix3d R_CG = scene.R_CG();
  // Another point of the plane than the gap's.
  problem.plane.p_H_mm = scene.X_HC * (scene.centre_C_mm() + R_CG * Vector3d(17, -8, 0));
  problem.plane.n_H = scene.X_HC.linear() * R_CG.col(2) * 3;
  GapSearch& search = problem.search;
  search.centre_px = scene.centre_px;
  const Vector2d along = pixel_of(scene, 0, 0.5) - pixel_of(scene, 0, -0.5);
  search.direction_rad = std::atan2(-along.x(), along.y()) + 0.04;  // as a person draws it
  search.half_across_px = 70;
  search.half_along_px = 45;
  search.min_gap_mm = std::min(1.5, scene.gap_mm / 2);
  search.max_gap_mm = 7;
  const auto sense = [](double from, double to) {
    return to > from ? EdgeSense::dark_to_bright : EdgeSense::bright_to_dark;
  };
  search.frame = sense(scene.frame_grey, scene.gap_grey);
  search.pane = sense(scene.gap_grey, scene.pane_grey);
  return problem;
}

Polygon blob(const Vector2d& centre_px, double half_px, double grey, std::mt19937_64& random) {
  Polygon polygon{{}, grey};
  const double a = between(0, 0.2, random), b = between(0, 0.15, random), phase = between(0, 6, random);
  for (int k = 0; k < 40; ++k) {
    const double t = 2 * pi * k / 40;
    const double r = half_px * (1 + a * std::cos(2 * t + phase) + b * std::cos(5 * t - phase));
    polygon.corners_px.push_back(centre_px + r * Vector2d(std::cos(t), std::sin(t)));
  }
  return polygon;
}

Polygon streak(const GapScene& scene, bool frame, double from_mm, double to_mm, double off_mm,
               double width_mm, double grey) {
  Polygon polygon{{}, grey};
  for (const auto& [along, side] : {std::pair{from_mm, -0.5}, {to_mm, -0.5}, {to_mm, 0.5}, {from_mm, 0.5}}) {
    const Vector2d at = on_edge(scene, frame, along, off_mm + side * width_mm);
    polygon.corners_px.push_back(pixel_of(scene, at.x(), at.y()));
  }
  return polygon;
}

GapResult measured(const GapScene& scene, const Picture& picture, std::mt19937_64& random) {
  constexpr double noise_grey = 2;
  const Pixels pixels = expose(picture, noise_grey, random);
  GapProblem problem = problem_of(scene);
  problem.image = pixels.view();
  return measure_gap(problem);
}

GapResult measured(const GapScene& scene, std::mt19937_64& random) {
  return measured(scene, paint(scene), random);
}

}  // namespace zeropose::test
