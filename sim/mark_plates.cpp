#include "sim/mark_plates.h"

#include <cmath>
#include <stdexcept>

namespace zeropose {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

Pose mark_pose(const Mark& mark, const Pose& X_CO) {
  Vector3d z_O = mark.normal_O;
  if (z_O.norm() < 1e-9) z_O = X_CO.linear().transpose() * -Vector3d::UnitZ();
  z_O.normalize();
  const Vector3d right_O = X_CO.linear().transpose() * Vector3d::UnitX();
  Pose X_OM = Pose::Identity();
  X_OM.linear().col(0) = (right_O - z_O * z_O.dot(right_O)).normalized();
  X_OM.linear().col(1) = z_O.cross(Vector3d(X_OM.linear().col(0)));
  X_OM.linear().col(2) = z_O;
  X_OM.translation() = mark.p_O_mm;
  return X_OM;
}

std::vector<Thing> plate_things(double radius_mm, double grey, Random& random) {
  const double angle = random.uniform(-0.4, 0.4);
  const Vector2d half(radius_mm + random.uniform(18, 24), radius_mm + random.uniform(18, 26));
  const Paint metal{.grey = grey, .bevel_mm = 2, .bevel_grey = 22};
  const bool six_sided = random.uniform() < 0.3;
  std::vector<Thing> things;
  if (six_sided) {
    things.push_back({hexagon(Vector2d::Zero(), angle, half.x()), metal});
    return things;
  }
  things.push_back({rounded_box(Vector2d::Zero(), angle, half, random.uniform(3, 12)), metal});
  const Shape plate = things.front().shape;
  const Vector2d across(-plate.axis.y(), plate.axis.x());
  for (const double side : {-1.0, 1.0}) {
    const Vector2d corner = side * ((half.x() - 7) * plate.axis + (half.y() - 7) * across);
    things.push_back({disc(corner, 2.8), {.grey = 0.8 * grey, .bevel_mm = 1.6, .bevel_grey = 40}});
  }
  return things;
}

}  // namespace

std::vector<Thing> cover_things(double radius_mm, double grey, Random& random) {
  const Vector2d half(radius_mm + random.uniform(7, 10), radius_mm + random.uniform(9, 13));
  const double angle = random.uniform(-0.6, 0.6);
  return {{rounded_box({2, 3}, angle, half, 3), {.grey = 0.6 * grey, .opacity = 0.6, .softness_mm = 2}},
          {rounded_box(Vector2d::Zero(), angle, half, 2),
           {.grey = 1.12 * grey, .bevel_mm = 1.5, .bevel_grey = 12}}};
}

MarkPlate make_plate(const Mark& mark, const Pose& X_CO, const PictureSettings& picture, Random& random) {
  if (mark.kind != MarkKind::disc)
    throw std::invalid_argument("mark " + mark.name + ": the simulated cell draws discs only");
  const bool dark = !mark.bright;
  const double surface = random.uniform(0.93, 1.07) * (dark ? picture.surface_grey : picture.mark_grey);
  MarkPlate plate;
  plate.name = mark.name;
  plate.X_OM = mark_pose(mark, X_CO);
  plate.radius_mm = mark.radius_mm;
  plate.mark_grey = dark ? picture.mark_grey : picture.surface_grey;
  plate.things = plate_things(mark.radius_mm, surface, random);
  plate.cover = cover_things(mark.radius_mm, surface, random);
  return plate;
}

double plate_reach_mm(const MarkPlate& plate) { return bounding_radius_mm(plate.things.front().shape); }

std::vector<MarkPlate> reference_plates(const Scene& scene, std::size_t camera) {
  Random random(scene.picture.seed * 1000 + 250 + camera);
  std::vector<MarkPlate> plates;
  for (const Mark& mark : marks_seen(scene.fixed_marks, scene.fixed_views, camera))
    plates.push_back(make_plate(mark, scene.cameras.at(camera).X_WC.inverse(), scene.picture, random));
  return plates;
}

void paint_plate(Canvas& canvas, const MarkPlate& plate, const Pose& X_CF, const Moment& moment) {
  const Pose X_CM = moment.placed(plate.name, canvas.camera(), X_CF * plate.X_OM);
  canvas.paint({Pose::Identity(), plate.things}, X_CM);
  if (moment.covered(plate.name))
    canvas.paint({Pose::Identity(), plate.cover}, X_CM);
  else
    canvas.fill(DiscOutline(plate.radius_mm), X_CM, plate.mark_grey);
}

}  // namespace zeropose
