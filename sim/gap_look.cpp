#include "sim/gap_look.h"

#include <cmath>

#include "sim/random.h"

namespace zeropose {
namespace {

using Eigen::Vector2d;

constexpr double seen_mm = 60;  // round a place, more than a camera sees

double angle_of(const Vector2d& direction) { return std::atan2(direction.y(), direction.x()); }
Vector2d along(const RimPlace& place) { return {-place.outward_T.y(), place.outward_T.x()}; }

// The middle of the gap that the car has where it stops ideally, in O.
Vector2d gap_middle(const GapsObject& object, const RimPlace& place) {
  return place.p_T_mm + true_gap_mm(object, place, Pose::Identity()) / 2 * place.outward_T;
}

// The edge of the opening nearest to it.
Vector2d frame_edge(const GapsObject& object, const RimPlace& place) {
  return place.p_T_mm + true_gap_mm(object, place, Pose::Identity()) * place.outward_T;
}

std::vector<Thing> surface(const Vector2d& at_mm, double grey) {
  return {{rounded_box(at_mm, 0, {seen_mm, seen_mm}, 0),
           {.grey = grey, .texture_grey = 1.5, .texture_mm = 0.8, .shading_grey = 4}}};
}

// The sealing bead, seen dark in the dark, and dust that lies clear of the edges on the paint.
void add_bead(std::vector<Thing>& things, const Vector2d& middle_mm, const RimPlace& place, double grey) {
  things.push_back({rounded_box(middle_mm - 1.5 * place.outward_T, angle_of(along(place)), {seen_mm, 1.2}, 0),
                    {.grey = grey + 6, .opacity = 0.8, .softness_mm = 0.5}});
}

void add_dust(std::vector<Thing>& things, const Vector2d& edge_mm, const RimPlace& place, double grey,
              int count, Random& random) {
  for (int piece = 0; piece < count; ++piece) {
    const Vector2d at =
        edge_mm + random.uniform(8, 16) * place.outward_T + random.uniform(-12, 12) * along(place);
    const double size = random.uniform(0.1, 0.5);
    things.push_back({rounded_box(at, random.uniform(0, 3), {size, 0.6 * size}, 0.5 * size),
                      {.grey = random.uniform() < 0.5 ? 0.5 * grey : 1.3 * grey,
                       .opacity = random.uniform(0.4, 0.9),
                       .softness_mm = 0.1}});
  }
}

// Irregular: a few round pieces one over the other.
void add_blob(std::vector<Thing>& things, const Vector2d& at_mm, double radius_mm, const Paint& paint,
              Random& random) {
  for (int piece = 0; piece < 4; ++piece) {
    const Vector2d off(random.uniform(-0.5, 0.5), random.uniform(-0.5, 0.5));
    things.push_back({disc(at_mm + radius_mm * off, random.uniform(0.5, 0.9) * radius_mm), paint});
  }
}

}  // namespace

GapLook::GapLook(const GapsObject& object, const Scene& scene, std::size_t camera)
    : object_(object),
      camera_(camera),
      body_grey_(scene.picture.surface_grey),
      gap_grey_(0.75 * scene.picture.mark_grey) {
  constexpr double glass_shade_grey = 6;
  const PictureSettings& picture = scene.picture;
  Random lamps(picture.seed * 1000 + 700 + camera), dust(picture.seed * 1000 + 500 + camera);
  light_ = drawn_light(scene.cameras.at(camera).model, picture.illumination_gradient, lamps);
  for (const RimPlace& place : object_.places) {
    if (place.camera != camera) continue;
    const Vector2d middle = gap_middle(object_, place);
    for (const Thing& thing : surface(middle, body_grey_)) body_.things.push_back(thing);
    add_dust(body_.things, frame_edge(object_, place), place, body_grey_, picture.clutter, dust);
    add_bead(flange_.things, middle, place, gap_grey_);
    glass_.things.push_back({rounded_box(place.p_T_mm, 0, {seen_mm, seen_mm}, 0),
                             {.grey = object_.pane_grey, .shading_grey = glass_shade_grey}});
  }
}

void GapLook::paint(Canvas& canvas, const Moment& moment) const {
  canvas.clear(gap_grey_);
  canvas.paint(flange_, moment.X_CO);
  Canvas body = canvas.like(body_grey_);
  body.paint(body_, moment.X_CO);
  canvas.fill(RoundedBoxOutline(object_.opening, RoundedBoxOutline::Side::outside), moment.X_CO, body);
  if (moment.X_CT) {
    Canvas glass = canvas.like(object_.pane_grey);
    glass.paint(glass_, *moment.X_CT);
    canvas.fill(RoundedBoxOutline(object_.pane), *moment.X_CT, glass);
  }
  for (const std::string& name : moment.faults.covered) {
    const auto spot = gap_spot(object_, name);
    if (spot && object_.places[spot->place].camera == camera_) paint_spot(canvas, *spot, moment);
  }
}

void GapLook::paint_spot(Canvas& canvas, const GapSpot& spot, const Moment& moment) const {
  constexpr double reach_mm = 8;  // along the edge, from the place
  const RimPlace& place = object_.places[spot.place];
  Random random(spot.number * 7919 + spot.place);
  const bool on_pane = spot.kind == "glint";
  const Vector2d edge = on_pane ? place.p_T_mm : frame_edge(object_, place);
  Sheet sheet;
  if (spot.kind == "hidden") {
    sheet.things = {{disc(edge + Vector2d(1.3, -0.8), 24), {.grey = 0.55 * body_grey_, .shading_grey = 8}}};
  } else if (spot.kind == "taped") {
    sheet.things = {{rounded_box(edge + place.outward_T, angle_of(place.outward_T), {2.6, seen_mm}, 0),
                     {.grey = 0.9 * body_grey_}}};
  } else {
    const Paint paint{.grey = on_pane ? 250.0 : 0.6 * gap_grey_, .softness_mm = on_pane ? 0.08 : 0.03};
    for (int blob = 0; blob < 3; ++blob)
      add_blob(sheet.things,
               edge + random.uniform(-reach_mm, reach_mm) * along(place) +
                   random.uniform(-0.5, 0.5) * place.outward_T,
               random.uniform(0.4, 1.2), paint, random);
  }
  if (!on_pane)
    canvas.paint(sheet, moment.X_CO);
  else if (moment.X_CT)
    canvas.paint(sheet, *moment.X_CT);
}

}  // namespace zeropose
