#include "sim/steel_sheet_look.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "sim/plane_view.h"
#include "sim/random.h"

namespace zeropose {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

// Round, so that it has no corners of its own.
std::vector<Thing> pad(double radius_mm, double grey) {
  return {{disc({3, 4}, radius_mm), {.grey = 0.6 * grey, .opacity = 0.5, .softness_mm = 4}},
          {disc(Vector2d::Zero(), radius_mm), {.grey = grey, .bevel_mm = 5, .bevel_grey = 8}}};
}

// Belts along x that carry the sheet, gaps between them.
std::vector<Thing> belts(double grey) {
  constexpr double pitch_mm = 500, half_belt_mm = 215, half_length_mm = 6000;
  std::vector<Thing> things;
  for (int belt = -4; belt <= 4; ++belt)
    things.push_back(
        {rounded_box({0, belt * pitch_mm}, 0, {half_length_mm, half_belt_mm}, 5),
         {.grey = grey, .softness_mm = 2, .texture_grey = 2.5, .texture_mm = 6, .shading_grey = 3}});
  return things;
}

struct Extent {
  Vector2d least = Vector2d::Constant(1e9), most = Vector2d::Constant(-1e9);
  Vector2d middle() const { return (least + most) / 2; }
  Vector2d half() const { return (most - least) / 2; }
};

Extent extent_of(const std::vector<Vector2d>& outline_mm) {
  Extent extent;
  for (const Vector2d& vertex : outline_mm) {
    extent.least = extent.least.cwiseMin(vertex);
    extent.most = extent.most.cwiseMax(vertex);
  }
  return extent;
}

// The steel with the lines that rolling left.
std::vector<Thing> rolled_steel(const Extent& extent, double grey, Random& random) {
  constexpr int lines = 24;
  const Vector2d beyond = extent.half() + Vector2d::Constant(100);  // for corners that are displaced
  std::vector<Thing> things{{rounded_box(extent.middle(), 0, beyond, 0),
                             {.grey = grey, .texture_grey = 2, .texture_mm = 5, .shading_grey = 5}}};
  for (int line = 0; line < lines; ++line) {
    const Vector2d place(0, random.uniform(-1, 1) * extent.half().y());
    things.push_back(
        {rounded_box(extent.middle() + place, random.uniform(-0.002, 0.002),
                     {beyond.x(), random.uniform(2, 14)}, 0),
         {.grey = grey + random.uniform(-20, 25), .opacity = random.uniform(0.1, 0.4), .softness_mm = 4}});
  }
  return things;
}

// Glints, oil stains and chalk strokes, clear of the features.
void add_clutter(std::vector<Thing>& things, const Extent& extent, const std::vector<Vector2d>& features,
                 double grey, int count, Random& random) {
  constexpr double clearance_mm = 190;
  for (int piece = 0; piece < count; ++piece) {
    const Vector2d place = extent.middle() + Vector2d(random.uniform(-1, 1) * extent.half().x(),
                                                      random.uniform(-1, 1) * extent.half().y());
    const double angle = random.uniform(-0.5, 0.5), size = random.uniform(20, 70), kind = random.uniform();
    const auto near = [&](const Vector2d& feature) { return (feature - place).norm() < clearance_mm + size; };
    if (std::ranges::any_of(features, near)) continue;
    if (kind < 0.4)
      things.push_back(
          {rounded_box(place, angle, {size, 4}, 4), {.grey = grey + 55, .opacity = 0.8, .softness_mm = 5}});
    else if (kind < 0.7)
      things.push_back({rounded_box(place, angle, {size, 0.5 * size}, 0.4 * size),
                        {.grey = 0.7 * grey, .opacity = 0.5, .softness_mm = 10}});
    else
      things.push_back({rounded_box(place, 3 * angle, {1.5 * size, 2.5}, 2.5),
                        {.grey = 215, .opacity = 0.7, .softness_mm = 1}});
  }
}

}  // namespace

SteelSheetLook::SteelSheetLook(const SheetObject& sheet, const Scene& scene, std::size_t camera)
    : surface_grey_(scene.picture.surface_grey),
      gap_grey_(0.75 * scene.picture.mark_grey),
      outline_mm_(sheet.outline_mm) {
  constexpr double conveyor_below_mm = 2;
  const PictureSettings& picture = scene.picture;
  // The conveyor and the steel are the same for all cameras, the light is not.
  Random steel(picture.seed * 1000), clutter(picture.seed * 1000 + 500),
      lamps(picture.seed * 1000 + 700 + camera);
  light_ = drawn_light(scene.cameras.at(camera).model, picture.illumination_gradient, lamps);
  std::vector<Vector2d> places;
  for (const Mark& mark : scene.marks) {
    features_.push_back(feature_of(mark));
    places.push_back(features_.back().place_mm);
  }
  conveyor_.X_FS = scene.X_WO_nominal * from_six_numbers({.z_mm = -conveyor_below_mm});
  conveyor_.things = belts(picture.mark_grey);
  const Extent extent = extent_of(outline_mm_);
  surface_.things = rolled_steel(extent, surface_grey_, steel);
  add_clutter(surface_.things, extent, places, surface_grey_, picture.clutter, clutter);
}

SteelSheetLook::Feature SteelSheetLook::feature_of(const Mark& mark) const {
  constexpr double corner_mm = 5, hole_pad_mm = 22, corner_pad_mm = 80;  // a drawing may be that wrong
  Feature feature;
  feature.name = mark.name;
  feature.place_mm = mark.p_O_mm.head<2>();
  if (mark.kind == MarkKind::disc && !mark.bright && mark.radius_mm > 0) {
    feature.radius_mm = mark.radius_mm;
    feature.cover = pad(mark.radius_mm + hole_pad_mm, 1.06 * surface_grey_);
    return feature;
  }
  if (mark.kind != MarkKind::corner || !mark.bright)
    throw std::invalid_argument("mark " + mark.name +
                                ": a sheet has dark discs (holes) and bright corners only");
  const auto away = [&](const Vector2d& vertex) { return (vertex - feature.place_mm).norm(); };
  const auto nearest = std::ranges::min_element(outline_mm_, {}, away);
  if (nearest == outline_mm_.end() || away(*nearest) > corner_mm)
    throw std::invalid_argument("mark " + mark.name + ": the sheet's outline has no corner there");
  feature.place_mm = *nearest;
  feature.corner = static_cast<std::size_t>(nearest - outline_mm_.begin());
  feature.cover = pad(corner_pad_mm, 0.96 * surface_grey_);
  return feature;
}

Vector2d SteelSheetLook::place_of(const Feature& feature, const CameraModel& camera,
                                  const Moment& moment) const {
  const auto displaced = moment.faults.displaced_px.find(feature.name);
  if (displaced == moment.faults.displaced_px.end()) return feature.place_mm;
  const auto u_px = project(camera, moment.X_CO * Vector3d(feature.place_mm.x(), feature.place_mm.y(), 0));
  if (!u_px) return feature.place_mm;
  const Vector2d to_px = *u_px + Vector2d(displaced->second, 0);
  return PlaneView(camera, moment.X_CO).meet(to_px).value_or(feature.place_mm);
}

PolygonOutline SteelSheetLook::outline(const CameraModel& camera, const Moment& moment) const {
  std::vector<Vector2d> vertices = outline_mm_;
  std::vector<RoundHole> holes;
  for (const Feature& feature : features_) {
    const Vector2d place = place_of(feature, camera, moment);
    if (feature.corner)
      vertices[*feature.corner] = place;
    else
      holes.push_back({place, feature.radius_mm});
  }
  return {vertices, std::move(holes)};
}

void SteelSheetLook::paint(Canvas& canvas, const Moment& moment) const {
  canvas.clear(gap_grey_);
  canvas.paint(conveyor_, moment.X_CW);
  Canvas steel = canvas.like(surface_grey_);
  steel.paint(surface_, moment.X_CO);
  canvas.fill(outline(canvas.camera(), moment), moment.X_CO, steel);
  for (const Feature& feature : features_) {
    if (!moment.covered(feature.name)) continue;
    const Vector2d place = place_of(feature, canvas.camera(), moment);
    canvas.paint({from_six_numbers({.x_mm = place.x(), .y_mm = place.y()}), feature.cover}, moment.X_CO);
  }
}

}  // namespace zeropose
