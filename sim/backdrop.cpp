#include "sim/backdrop.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "sim/clutter.h"
#include "sim/random.h"

namespace zeropose {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double clearance_px = 12;  // between clutter and a mark's outline ...
constexpr double reach_mm_xyz = 30;  // ... within this range of poses
constexpr double reach_deg_xyz = 0.2;
constexpr double standing_depth_share = 0.85;  // standing things hang nearer than the marks

// Everything the builders below share.
struct Stage {
  const CalibratedCamera& camera;
  std::vector<Mark> marks;  // that this camera sees
  Pose X_WO;
  Pose X_CO;
  Pose X_CP;             // P: the panel behind the marks, axes roughly as the camera's
  double px_per_mm = 0;  // at the panel
  double panel_grey = 0;
  PictureSettings picture;

  Vector2d on_panel(const Vector2d& u_px) const {
    const auto d_C = ray(camera.model, u_px);
    if (!d_C) return Vector2d::Zero();
    const Vector3d d = X_CP.linear().transpose() * *d_C;
    const Vector3d p = -(X_CP.linear().transpose() * X_CP.translation());
    return p.head<2>() - p.z() / d.z() * d.head<2>();
  }
};

Stage make_stage(const Scene& scene, std::size_t camera_index, Random& random) {
  const CalibratedCamera& camera = scene.cameras.at(camera_index);
  Stage stage{.camera = camera,
              .marks = marks_seen(scene.marks, scene.views, camera_index),
              .X_WO = scene.X_WO_nominal,
              .X_CO = camera.X_WC.inverse() * scene.X_WO_nominal,
              .X_CP = Pose::Identity(),
              .px_per_mm = 0,
              .panel_grey = 0.58 * scene.picture.surface_grey,
              .picture = scene.picture};
  double depth_mm = 1000;
  for (const Mark& mark : stage.marks) depth_mm = std::max(depth_mm, (stage.X_CO * mark.p_O_mm).z() + 60);
  const Vector2d middle(camera.model.width_px / 2.0, camera.model.height_px / 2.0);
  const SixNumbers tilt{.rx_deg = random.uniform(-8, 8), .ry_deg = random.uniform(-8, 8), .rz_deg = 0};
  stage.X_CP = from_six_numbers(tilt);
  stage.X_CP.translation() = depth_mm * ray(camera.model, middle).value_or(Vector3d::UnitZ());
  stage.px_per_mm = camera.model.fx_px / depth_mm;
  return stage;
}

// ---- the underbody behind them

// The border of the picture with the most room: there the object ends. Direction out of the picture.
Vector2d open_side(const Stage& stage) {
  const Vector2d size(stage.camera.model.width_px, stage.camera.model.height_px);
  const std::array<Vector2d, 4> sides{Vector2d(-1, 0), Vector2d(1, 0), Vector2d(0, -1), Vector2d(0, 1)};
  const auto room = [&](const Vector2d& side) {
    double least = 1e9;
    for (const Mark& mark : stage.marks) {
      const auto u = project(stage.camera.model, stage.X_CO * mark.p_O_mm);
      if (u) least = std::min(least, (size / 2).dot(side.cwiseAbs()) - (*u - size / 2).dot(side));
    }
    return least;
  };
  return *std::ranges::max_element(sides, {}, room);
}

struct Edge {
  Vector2d side;   // out of the picture
  Vector2d place;  // on the panel, mm
};

Edge open_edge(const Stage& stage) {
  constexpr double visible_hall_px = 42;
  const Vector2d side = open_side(stage);
  const Vector2d size(stage.camera.model.width_px, stage.camera.model.height_px);
  return {side, stage.on_panel(size / 2 + side.cwiseProduct(size / 2) - visible_hall_px * side)};
}

constexpr double half_panel_mm = 600, half_beam_mm = 520;

Thing panel(const Stage& stage, const Edge& edge, Random& random) {
  return {rounded_box(edge.place - half_panel_mm * edge.side, random.uniform(-0.05, 0.05),
                      Vector2d::Constant(half_panel_mm), 20),
          {.grey = stage.panel_grey,
           .bevel_mm = 7,
           .bevel_grey = 34,
           .texture_grey = 5,
           .texture_mm = 2.2,
           .shading_grey = 13}};
}

// The middle of a beam through `through` that ends where the panel ends, if it runs towards that edge.
Vector2d beam_middle(const Edge& edge, const Vector2d& through, double angle) {
  constexpr double margin_mm = 16;
  const Vector2d along(std::cos(angle), std::sin(angle));
  const double towards = along.dot(edge.side);
  if (std::abs(towards) < 0.5) return through;
  const double to_edge = (edge.place - through).dot(edge.side) / towards;
  return through + (to_edge - std::copysign(half_beam_mm + margin_mm, towards)) * along;
}

void add_beam(std::vector<Thing>& things, const Vector2d& centre, double angle, double half_width,
              double grey) {
  const Vector2d half(half_beam_mm, half_width);
  things.push_back({rounded_box(centre + Vector2d(7, 10), angle, half, 6),
                    {.grey = 0.35 * grey, .opacity = 0.65, .softness_mm = 6}});
  things.push_back({rounded_box(centre, angle, half, 6),
                    {.grey = grey,
                     .bevel_mm = 9,
                     .bevel_grey = 40,
                     .texture_grey = 3,
                     .texture_mm = 3,
                     .shading_grey = 9}});
}

void add_ribs(std::vector<Thing>& things, const Vector2d& start, double angle, double grey) {
  const Vector2d across(-std::sin(angle), std::cos(angle));
  for (int rib = 0; rib < 5; ++rib)
    things.push_back({rounded_box(start + 26.0 * rib * across, angle, {78, 6.5}, 6.5),
                      {.grey = 0.92 * grey, .bevel_mm = 6, .bevel_grey = -30}});
}

void add_seam(std::vector<Thing>& things, const Vector2d& middle, double angle, double grey) {
  const Vector2d along(std::cos(angle), std::sin(angle)), across(-along.y(), along.x());
  things.push_back(
      {rounded_box(middle, angle, {half_beam_mm, 1.1}, 1), {.grey = 0.45 * grey, .opacity = 0.8}});
  things.push_back({rounded_box(middle - 2.2 * across, angle, {half_beam_mm, 0.9}, 0.8),
                    {.grey = 1.5 * grey, .opacity = 0.5}});
  for (int weld = -15; weld <= 15; ++weld)
    things.push_back({disc(middle + 11 * across + 34.0 * weld * along, 3.2),
                      {.grey = 0.85 * grey, .opacity = 0.8, .bevel_mm = 2.5, .bevel_grey = -22}});
}

void add_shadows(std::vector<Thing>& things, const Stage& stage, const std::vector<MarkPlate>& plates) {
  for (const MarkPlate& plate : plates) {
    const auto u = project(stage.camera.model, stage.X_CO * plate.X_OM.translation());
    if (!u) continue;
    const double half = 0.78 * plate_reach_mm(plate);
    things.push_back({rounded_box(stage.on_panel(*u) + Vector2d(13, 17), 0, {half, half}, 10),
                      {.grey = 0.3 * stage.panel_grey, .opacity = 0.75, .softness_mm = 7}});
  }
}

Sheet underbody(const Stage& stage, const std::vector<MarkPlate>& plates, Random& random) {
  Sheet sheet{stage.X_CO.inverse() * stage.X_CP, {}};
  const double grey = stage.panel_grey, angle = random.uniform(-0.12, 0.12);
  const Edge edge = open_edge(stage);
  sheet.things.push_back(panel(stage, edge, random));
  add_ribs(sheet.things, {random.uniform(-160, 120), random.uniform(-150, 0)},
           angle + random.uniform(-0.05, 0.05), grey);
  add_seam(sheet.things, beam_middle(edge, {0, random.uniform(-170, -60)}, angle), angle, grey);
  add_beam(sheet.things, beam_middle(edge, {0, random.uniform(60, 150)}, angle), angle,
           random.uniform(24, 34), 1.12 * grey);
  const double upright = angle + std::numbers::pi / 2;
  add_beam(sheet.things, beam_middle(edge, {random.uniform(-170, 170), 0}, upright), upright,
           random.uniform(16, 24), 1.05 * grey);
  add_shadows(sheet.things, stage, plates);
  return sheet;
}

// ---- the hall: what stands still behind the object, out of focus

Sheet hall(const Stage& stage, Random& random) {
  constexpr double farther = 1.6;  // than the panel
  Sheet sheet{stage.X_CP, {}};
  sheet.X_FS.translation() *= farther;
  const Edge edge = open_edge(stage);
  const Vector2d along(-edge.side.y(), edge.side.x());
  const auto add = [&](const Vector2d& half_mm, double angle, const Paint& paint) {
    const Vector2d place =
        farther * edge.place + random.uniform(-40, 120) * edge.side + random.uniform(-330, 330) * along;
    sheet.things.push_back({rounded_box(place, angle, half_mm, 2), paint});
  };
  for (int post = 0; post < 6; ++post)
    add({random.uniform(40, 200), random.uniform(8, 22)}, random.uniform() < 0.5 ? 0.0 : std::numbers::pi / 2,
        {.grey = random.uniform(36, 66), .softness_mm = 4});
  for (int lamp = 0; lamp < 2; ++lamp)
    add({random.uniform(12, 30), 6}, random.uniform(-0.2, 0.2),
        {.grey = 170, .opacity = 0.8, .softness_mm = 5});
  return sheet;
}

// ---- clutter

// Reference points stand in front of everything: nothing may come near.
void take_fixed(const Stage& stage, const std::vector<MarkPlate>& fixed_plates, std::vector<Taken>& taken) {
  for (const MarkPlate& plate : fixed_plates) {
    const Vector3d p_C = stage.camera.X_WC.inverse() * plate.X_OM.translation();
    const auto u = project(stage.camera.model, p_C);
    if (u) taken.push_back({*u, plate_reach_mm(plate) * stage.camera.model.fx_px / p_C.z() + clearance_px});
  }
}

// How far a mark's centre can be from its nominal place in the image.
double excursion_px(const Mark& mark, const Stage& stage) {
  const auto nominal = project(stage.camera.model, stage.X_CO * mark.p_O_mm);
  double largest = 0;
  for (unsigned corner = 0; corner < 64; ++corner) {
    const auto sign = [corner](unsigned bit) { return (corner >> bit & 1U) != 0 ? 1.0 : -1.0; };
    const Pose X_OO =
        from_six_numbers({sign(0) * reach_mm_xyz, sign(1) * reach_mm_xyz, sign(2) * reach_mm_xyz,
                          sign(3) * reach_deg_xyz, sign(4) * reach_deg_xyz, sign(5) * reach_deg_xyz});
    const auto u = project(stage.camera.model, stage.X_CO * X_OO * mark.p_O_mm);
    if (nominal && u) largest = std::max(largest, (*u - *nominal).norm());
  }
  return largest;
}

std::vector<Taken> taken_for_standing(const Stage& stage) {
  std::vector<Taken> taken;
  for (const Mark& mark : stage.marks) {
    const Vector3d p_C = stage.X_CO * mark.p_O_mm;
    const auto u = project(stage.camera.model, p_C);
    if (!u) continue;
    const double radius_px = 1.03 * mark.radius_mm * stage.camera.model.fx_px / p_C.z();
    taken.push_back({*u, radius_px + clearance_px + excursion_px(mark, stage) + 4});
  }
  return taken;
}

std::vector<Taken> taken_for_object(const Stage& stage, const std::vector<MarkPlate>& plates) {
  constexpr double parallax_px = 10;  // between plate and panel over the range of poses
  std::vector<Taken> taken;
  for (const MarkPlate& plate : plates) {
    const Vector3d p_C = stage.X_CO * plate.X_OM.translation();
    const auto u = project(stage.camera.model, p_C);
    if (u) taken.push_back({*u, plate_reach_mm(plate) * stage.camera.model.fx_px / p_C.z() + parallax_px});
  }
  return taken;
}

void add_object_clutter(const Stage& stage, int count, std::vector<Taken> taken, Sheet& panel_sheet,
                        Random& random) {
  const int first_kind = static_cast<int>(random.uniform(0, 8));
  for (int piece = 0; piece < count; ++piece) {
    std::vector<Thing> things = make_clutter(first_kind + piece, stage.panel_grey, random);
    const double radius_px = 1.2 * reach_mm(things) * stage.px_per_mm + 4;
    const auto place = free_place(stage.camera.model, radius_px, taken, random);
    if (!place) continue;
    taken.push_back({*place, radius_px});
    move(things, stage.on_panel(*place));
    panel_sheet.things.insert(panel_sheet.things.end(), things.begin(), things.end());
  }
}

std::vector<Sheet> standing_clutter(const Stage& stage, int count, std::vector<Taken> taken, Random& random) {
  std::vector<Sheet> sheets;
  const int first_kind = static_cast<int>(random.uniform(0, 4));
  const double depth_mm = standing_depth_share * stage.X_CP.translation().z();
  for (int piece = 0; piece < count; ++piece) {
    Sheet sheet{Pose::Identity(), make_clutter(first_kind + piece, 1.2 * stage.panel_grey, random)};
    const double radius_px = reach_mm(sheet.things) * stage.camera.model.fx_px / depth_mm + 4;
    const auto place = free_place(stage.camera.model, radius_px, taken, random);
    if (!place) continue;
    taken.push_back({*place, radius_px});
    sheet.X_FS.translation() = depth_mm * ray(stage.camera.model, *place).value_or(Vector3d::UnitZ());
    sheets.push_back(std::move(sheet));
  }
  return sheets;
}

}  // namespace

Backdrop make_backdrop(const Scene& scene, std::size_t camera) {
  // Separate draws, so that the amount of clutter changes nothing else.
  Random looks(scene.picture.seed * 1000 + camera), clutter(scene.picture.seed * 1000 + 500 + camera);
  const Stage stage = make_stage(scene, camera, looks);
  Backdrop backdrop;
  backdrop.hall_grey = 24;
  backdrop.light = drawn_light(stage.camera.model, scene.picture.illumination_gradient, looks);
  for (const Mark& mark : stage.marks)
    backdrop.plates.push_back(make_plate(mark, stage.X_CO, scene.picture, looks));
  backdrop.behind.push_back(hall(stage, looks));
  backdrop.on_object.push_back(underbody(stage, backdrop.plates, looks));
  const std::vector<MarkPlate> references = reference_plates(scene, camera);
  std::vector<Taken> on_object = taken_for_object(stage, backdrop.plates),
                     in_front = taken_for_standing(stage);
  take_fixed(stage, references, on_object);
  take_fixed(stage, references, in_front);
  const int standing = scene.picture.clutter / 3;
  add_object_clutter(stage, scene.picture.clutter - standing, std::move(on_object), backdrop.on_object.back(),
                     clutter);
  backdrop.in_front = standing_clutter(stage, standing, std::move(in_front), clutter);
  return backdrop;
}

}  // namespace zeropose
