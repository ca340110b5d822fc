#include "sim/ball_plate_look.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>

#include "sim/random.h"

namespace zeropose {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double room_grey = 14, frame_grey = 38, frame_mm = 4;

// Where the plate is seen behind a ball from the place of the camera.
struct Behind {
  Vector2d place_mm = Vector2d::Zero();  // on the plate, about its middle
  double radius_mm = 0;
};

std::vector<Behind> places_behind(const std::vector<Mark>& balls, const Vector3d& middle_O_mm,
                                  const Vector3d& p_OC_mm) {
  std::vector<Behind> places;
  for (const Mark& ball : balls) {
    const Vector3d d = ball.p_O_mm - p_OC_mm;
    const double way = (middle_O_mm.z() - p_OC_mm.z()) / d.z();
    places.push_back({(p_OC_mm + way * d - middle_O_mm).head<2>(), way * ball.radius_mm});
  }
  return places;
}

// Specks and threads on the glass, clear of the balls as long as the plate stands about where it should.
void add_dirt(std::vector<Thing>& things, const Vector2d& half_mm, const std::vector<Behind>& taken,
              int count, Random& random) {
  constexpr double clearance_mm = 2.2;
  for (int piece = 0; piece < count; ++piece) {
    const Vector2d place(random.uniform(-1, 1) * half_mm.x(), random.uniform(-1, 1) * half_mm.y());
    const double angle = random.uniform(0, std::numbers::pi), size = random.uniform(0.1, 0.45);
    const bool thread = random.uniform() < 0.25;
    const double opacity = random.uniform(0.15, 0.5);
    const double reach = thread ? 5 * size : size;
    const auto near = [&](const Behind& ball) {
      return (ball.place_mm - place).norm() < ball.radius_mm + clearance_mm + reach;
    };
    if (std::ranges::any_of(taken, near)) continue;
    const Vector2d half(reach, thread ? 0.04 : size * random.uniform(0.6, 1));
    things.push_back({rounded_box(place, angle, half, half.minCoeff()),
                      {.grey = 60, .opacity = opacity, .softness_mm = 0.08}});
  }
}

std::vector<Thing> plate_things(const Vector2d& half_mm, double grey, Random& random) {
  const Vector2d frame = half_mm + Vector2d::Constant(frame_mm);
  std::vector<Thing> things{
      {rounded_box(Vector2d::Zero(), 0, frame, 3), {.grey = frame_grey, .bevel_mm = 1, .bevel_grey = 12}},
      {rounded_box(Vector2d::Zero(), 0, half_mm, 2), {.grey = grey}}};
  for (int lamp = 0; lamp < 6; ++lamp) {
    const Vector2d place(random.uniform(-0.6, 0.6) * half_mm.x(), random.uniform(-0.6, 0.6) * half_mm.y());
    things.push_back({disc(place, 4), {.grey = 1.08 * grey, .opacity = 0.4, .softness_mm = 6}});
  }
  return things;
}

// A piece of tape on the pin before it.
std::vector<Thing> tape(double radius_mm, double grey, Random& random) {
  const Vector2d half = radius_mm * Vector2d(random.uniform(2, 2.4), random.uniform(1.3, 1.5));
  return {{rounded_box(Vector2d::Zero(), random.uniform(-0.6, 0.6), half, 0.2 * radius_mm), {.grey = grey}}};
}

}  // namespace

TangentDisc tangent_disc(const Vector3d& p_C_mm, double radius_mm) {
  const double nearer = 1 - radius_mm * radius_mm / p_C_mm.squaredNorm();
  TangentDisc disc;
  disc.radius_mm = radius_mm * std::sqrt(nearer);
  disc.X_CM.translation() = nearer * p_C_mm;
  disc.X_CM.linear().col(2) = p_C_mm.normalized();
  disc.X_CM.linear().col(0) = p_C_mm.unitOrthogonal();
  disc.X_CM.linear().col(1) = disc.X_CM.linear().col(2).cross(Vector3d(disc.X_CM.linear().col(0)));
  return disc;
}

void paint_ball(Canvas& canvas, const Vector3d& p_C_mm, double radius_mm, double grey) {
  if (!(p_C_mm.z() > radius_mm)) return;  // behind the camera
  const TangentDisc seen = tangent_disc(p_C_mm, radius_mm);
  canvas.fill(DiscOutline(seen.radius_mm), seen.X_CM, grey);
}

BallPlateLook::BallPlateLook(const BallPlateObject& plate, const Scene& scene, std::size_t camera) {
  const PictureSettings& picture = scene.picture;
  Random looks(picture.seed * 1000 + camera), dirt(picture.seed * 1000 + 500 + camera);
  light_ = drawn_light(scene.cameras.at(camera).model, picture.illumination_gradient, looks);
  for (const Mark& mark : scene.marks) {
    if (mark.kind != MarkKind::ball || !(mark.radius_mm > 0))
      throw std::invalid_argument("mark " + mark.name + ": a ball plate has balls of known radius only");
    const double grey = mark.bright ? picture.surface_grey : picture.mark_grey;
    balls_.push_back({mark.name, mark.p_O_mm, mark.radius_mm, grey, tape(mark.radius_mm, grey, looks)});
  }
  const Pose X_OC = scene.X_WO_nominal.inverse() * scene.cameras.at(camera).X_WC;
  const Vector2d half = plate.size_mm / 2;
  plate_.X_FS.translation() = plate.middle_O_mm;
  plate_.things = plate_things(half, picture.surface_grey, looks);
  add_dirt(plate_.things, half, places_behind(scene.marks, plate.middle_O_mm, X_OC.translation()),
           picture.clutter, dirt);
}

void BallPlateLook::paint_ball(Canvas& canvas, const Ball& ball, const Moment& moment) const {
  Pose X_OM = Pose::Identity();
  X_OM.translation() = ball.p_O_mm;
  const Pose X_CM = moment.placed(ball.name, canvas.camera(), moment.X_CO * X_OM);
  zeropose::paint_ball(canvas, X_CM.translation(), ball.radius_mm, ball.grey);
  if (moment.covered(ball.name)) canvas.paint({Pose::Identity(), ball.cover}, X_CM);
}

// What is nearer hides what is behind.
void BallPlateLook::paint(Canvas& canvas, const Moment& moment) const {
  canvas.clear(room_grey);
  canvas.paint(plate_, moment.X_CO);
  std::vector<const Ball*> farthest_first;
  for (const Ball& ball : balls_) farthest_first.push_back(&ball);
  std::ranges::stable_sort(farthest_first, std::greater<>(),
                           [&](const Ball* ball) { return (moment.X_CO * ball->p_O_mm).z(); });
  for (const Ball* ball : farthest_first) paint_ball(canvas, *ball, moment);
}

}  // namespace zeropose
