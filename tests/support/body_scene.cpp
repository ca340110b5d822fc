#include "tests/support/body_scene.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "tests/support/csv.h"
#include "tests/support/synthetic_camera.h"

namespace zeropose::test {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr int outline_corners = 90;
const Vector3d middle_B(120, 140, 80);

std::vector<Vector2d> outline_of(const BodyScene& scene, const Vector3d& p_B, const Vector3d& normal,
                                 double radius_mm) {
  const Vector3d x = normal.unitOrthogonal(), y = normal.cross(x);
  // A polygon of the circle's area.
  const double step = 2 * std::numbers::pi / outline_corners;
  const double radius = radius_mm * std::sqrt(step / std::sin(step));
  std::vector<Vector2d> corners;
  for (int k = 0; k < outline_corners; ++k)
    corners.push_back(photograph(scene.camera, scene.X_CB.inverse(),
                                 p_B + radius * (std::cos(k * step) * x + std::sin(k * step) * y)));
  return corners;
}

Figure polygon(std::vector<Vector2d> corners, double grey) {
  Figure figure;
  figure.corners_px = std::move(corners);
  figure.grey = grey;
  return figure;
}

// The three walls, each from its corner at the origin.
void add_walls(const BodyScene& scene, Drawing& drawing) {
  const Vector3d x(285, 0, 0), y(0, 355, 0), z(0, 0, 225);
  int wall = 0;
  for (const auto& [a, b] : {std::pair(x, y), std::pair(z, x), std::pair(y, z)}) {
    std::vector<Vector2d> corners;
    for (const Vector3d& corner : {Vector3d(0, 0, 0), a, Vector3d(a + b), b})
      corners.push_back(photograph(scene.camera, scene.X_CB.inverse(), corner));
    drawing.figures.push_back(polygon(corners, scene.surface - 8 * wall++));
  }
}

bool is_clear(const Drawing& drawing, const Vector2d& u_px, double room_px) {
  return std::none_of(drawing.figures.begin(), drawing.figures.end(), [&](const Figure& figure) {
    if (figure.corners_px.size() != outline_corners)
      return figure.a_px > 0 && (figure.centre_px - u_px).norm() < room_px + figure.a_px;
    return std::any_of(figure.corners_px.begin(), figure.corners_px.end(),
                       [&](const Vector2d& corner) { return (corner - u_px).norm() < room_px; });
  });
}

void add_false_discs(const BodyScene& scene, std::mt19937_64& random, Drawing& drawing) {
  std::uniform_real_distribution<double> part(0.05, 0.95), size(9, 24), ratio(0.5, 1), angle(0, 3.1);
  int left = scene.false_discs;
  for (int tries = 0; left > 0 && tries < 2000; ++tries) {
    const Vector2d at(part(random) * drawing.width_px, part(random) * drawing.height_px);
    if (!is_clear(drawing, at, 30)) continue;
    drawing.figures.push_back(ellipse(at, size(random), ratio(random), angle(random), scene.print));
    --left;
  }
}

}  // namespace

Vector3d body_normal(const BodyMark& mark) {
  const int number = std::stoi(mark.name);
  return number <= 20 ? Vector3d(0, 0, 1) : number <= 32 ? Vector3d(0, 1, 0) : Vector3d(1, 0, 0);
}

std::vector<BodyMark> published_body(double radius_mm, bool with_normals) {
  const CsvTable table("tests/golden/calibration-body.csv");
  std::vector<BodyMark> marks;
  for (std::size_t row = 0; row < table.size(); ++row) {
    BodyMark mark;
    mark.name = table.text(row, "mark");
    mark.p_B_mm = {table.number(row, "x_mm"), table.number(row, "y_mm"), table.number(row, "z_mm")};
    mark.radius_mm = radius_mm;
    if (with_normals) mark.normal_B = body_normal(mark);
    marks.push_back(mark);
  }
  return marks;
}

Vector2d BodyScene::centre_px(const BodyMark& mark) const {
  return photograph(camera, X_CB.inverse(), mark.p_B_mm);
}

bool BodyScene::is_inside(const BodyMark& mark) const {
  const std::vector<Vector2d> corners = outline_of(*this, mark.p_B_mm, body_normal(mark), radius_mm);
  return std::all_of(corners.begin(), corners.end(), [&](const Vector2d& u) {
    return u.x() > 6 && u.y() > 6 && u.x() < camera.width_px - 7 && u.y() < camera.height_px - 7;
  });
}

Pose looking_at_body(const Vector3d& from_B, double distance_mm, double roll_deg) {
  const Vector3d z = -from_B.normalized();
  Pose X_BC = Pose::Identity();
  X_BC.linear().col(2) = z;
  X_BC.linear().col(0) = Vector3d(0.02, 0.03, 1).cross(z).normalized();
  X_BC.linear().col(1) = z.cross(X_BC.linear().col(0));
  X_BC.linear() *= Eigen::AngleAxisd(roll_deg / degrees_per_radian, Vector3d::UnitZ()).matrix();
  X_BC.translation() = middle_B - distance_mm * z;
  return X_BC.inverse();
}

Pixels photograph(const BodyScene& scene) {
  std::mt19937_64 random(scene.seed);
  Drawing drawing;
  drawing.width_px = scene.camera.width_px;
  drawing.height_px = scene.camera.height_px;
  drawing.background = scene.surroundings;
  drawing.shading_per_px = Vector2d(2e-4, -1e-4);
  add_walls(scene, drawing);
  const std::vector<BodyMark> marks = scene.marks();
  for (std::size_t k = 0; k < marks.size(); ++k)
    if (!scene.hidden.contains(k))
      drawing.figures.push_back(
          polygon(outline_of(scene, marks[k].p_B_mm, body_normal(marks[k]), scene.radius_mm), scene.print));
  add_false_discs(scene, random, drawing);
  return expose(paint(drawing), scene.noise_grey, random);
}

}  // namespace zeropose::test
