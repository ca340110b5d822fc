#include "config/cell.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>

#include "config/camera_options.h"
#include "config/cameras.h"
#include "config/cell_checks.h"
#include "config/files.h"
#include "config/ipv4.h"
#include "config/json_reader.h"
#include "config/robot_link.h"
#include "config/text.h"

namespace zeropose {
namespace {

constexpr double largest_mm = 1e6;
// In pairs of one kind, dark and bright.
constexpr std::array<std::string_view, 12> mark_kind_names{
    "dark_disc", "bright_disc", "dark_ring",  "bright_ring",  "dark_ball",   "bright_ball",
    "dark_slot", "bright_slot", "dark_cross", "bright_cross", "dark_corner", "bright_corner"};
constexpr std::array mark_kinds{MarkKind::disc, MarkKind::ring,  MarkKind::ball,
                                MarkKind::slot, MarkKind::cross, MarkKind::corner};
constexpr std::array<std::string_view, 4> frame_names{"object_zero", "world_shift", "robot_base_shift",
                                                      "user_frame"};

void read_milliseconds(JsonObject& object, std::string_view key, std::chrono::milliseconds& value, int min,
                       int max) {
  int count = static_cast<int>(value.count());
  if (object.read_optional(key, count, min, max)) value = std::chrono::milliseconds(count);
}

// A direction of length 1 within 1 %, then exactly 1.
void take_direction(JsonObject& object, std::string_view key, const Eigen::Vector3d& given,
                    Eigen::Vector3d& direction) {
  if (std::abs(given.norm() - 1) > 0.01)
    object.add_mistake(key, concat({"a vector of length ", std::to_string(given.norm())}),
                       "a unit vector (length 0.99 to 1.01)");
  else
    direction = given.normalized();
}

void read_normal(JsonObject& object, Eigen::Vector3d& normal_O) {
  Eigen::Vector3d given;
  if (object.read_optional("normal", given, 2.0)) take_direction(object, "normal", given, normal_O);
}

// The cameras of a mark by name; indices are found once the file is read.
struct NamedMark {
  Mark mark;
  std::vector<std::string> cameras;
};

// A ring has a circle inside, other marks have none.
void read_inner_radius(JsonObject& object, Mark& mark) {
  double radius_mm = 0;
  const bool given = object.read_optional("inner_radius_mm", radius_mm, NumberRange{0, 1000, true});
  const bool ring = mark.kind == MarkKind::ring;
  if (ring && !(radius_mm > 0 && radius_mm < mark.radius_mm))
    object.add_mistake("inner_radius_mm", given ? "a radius not below radius_mm" : "a ring without it",
                       "the radius of the ring's inner circle, mm, below radius_mm");
  if (!ring && given) object.add_mistake("inner_radius_mm", "a mark that is no ring", "no such key");
  if (ring) mark.inner_radii_mm = {radius_mm};
}

// A corner has two edges that can be told from one straight line, other marks have none.
void read_edges(JsonObject& object, Mark& mark) {
  constexpr double least_sine = 0.25;  // 15 degrees
  std::vector<Eigen::Vector3d> given;
  const bool there = object.read_optional("edges", given, 2.0);
  if (mark.kind != MarkKind::corner) {
    if (there) object.add_mistake("edges", "a mark that is no corner", "no such key");
    return;
  }
  const auto no_direction = [](const Eigen::Vector3d& edge) { return std::abs(edge.norm() - 1) > 0.01; };
  if (given.size() != 2 || std::ranges::any_of(given, no_direction) ||
      given[0].cross(given[1]).norm() < least_sine) {
    object.add_mistake("edges", there ? "no two such edges" : "a corner without them",
                       "two unit vectors along the corner's edges, away from it, 15 to 165 degrees apart");
    return;
  }
  for (const Eigen::Vector3d& edge : given) mark.edges_O.push_back(edge.normalized());
}

// What a mark and a reference point have in common; the inner radius is read after the radius.
NamedMark read_look(JsonObject& object) {
  NamedMark named;
  Mark& mark = named.mark;
  std::size_t kind = 0;
  object.read("name", mark.name);
  object.read("cameras", named.cameras);
  if (object.read_word("kind", mark_kind_names, kind)) {
    mark.kind = mark_kinds[kind / 2];
    mark.bright = kind % 2 == 1;
  }
  read_normal(object, mark.normal_O);
  object.read_optional("radius_mm", mark.radius_mm, NumberRange{0, 1000, true});
  read_inner_radius(object, mark);
  return named;
}

NamedMark read_mark(JsonObject& object) {
  NamedMark named = read_look(object);
  Mark& mark = named.mark;
  read_edges(object, mark);
  object.read("position_mm", mark.p_O_mm, largest_mm);
  object.read_optional("weight", mark.weight, NumberRange{0, 1});
  object.read_optional("tolerance_px", mark.tolerance_px, NumberRange{0, 1000, true});
  object.read_optional("tolerance_mm", mark.tolerance_mm, NumberRange{0, 1000, true});
  object.read_optional("sigma_mm", mark.sigma_mm, NumberRange{0, 100});
  return named;
}

void read_requirements(JsonObject& object, Requirements& requirements) {
  object.read("min_marks", requirements.min_marks, 2, 10000);
  object.read_optional("min_marks_per_camera", requirements.min_marks_per_camera, 0, 10000);
  object.read_optional("min_cameras", requirements.min_cameras, 1, 1000);
  object.read("max_sigma_mm", requirements.max_sigma_mm, NumberRange{0, 100, true});
  object.read_optional("max_hidden_mm", requirements.max_hidden_mm, NumberRange{0, 1000, true});
  object.read_optional("max_compensation_mm", requirements.max_compensation_mm, NumberRange{0, 100});
  object.read_optional("max_displacement_mm", requirements.max_displacement_mm, NumberRange{0, 10000});
  object.read_optional("max_step_mm", requirements.max_step_mm, NumberRange{0, 10000});
  object.read_optional("max_step_deg", requirements.max_step_deg, NumberRange{0, 180});
}

void read_limits(JsonObject& object, std::array<Range, 6>& limits) {
  constexpr std::array keys{"x_mm", "y_mm", "z_mm", "rx_deg", "ry_deg", "rz_deg"};
  for (std::size_t i = 0; i < keys.size(); ++i)
    object.read_range(keys[i], limits[i].min, limits[i].max, i < 3 ? 10000 : 180);
}

ApplicationPoint read_application_point(JsonObject& object) {
  ApplicationPoint point;
  object.read("name", point.name);
  object.read("position_mm", point.p_O_mm, largest_mm);
  return point;
}

// Turns the names of the cameras of the mark of this index into views.
void add_views(JsonObject& object, const NamedMark& named, const std::vector<CameraOptions>& cameras,
               std::size_t index, std::vector<View>& views) {
  if (object.has("cameras") && named.cameras.empty())
    object.add_mistake("cameras", "no camera", "at least one name of a camera of this cell");
  for (std::size_t i = 0; i < named.cameras.size(); ++i) {
    const std::string& name = named.cameras[i];
    const std::string key = path_of("cameras", i);
    const auto camera = std::ranges::find(cameras, name, &CameraOptions::name);
    if (camera == cameras.end())
      object.add_mistake(key, in_quotes(name), "the name of a camera of this cell");
    else if (std::find(named.cameras.begin(), named.cameras.begin() + static_cast<std::ptrdiff_t>(i), name) !=
             named.cameras.begin() + static_cast<std::ptrdiff_t>(i))
      object.add_mistake(key, in_quotes(name) + " twice", "each camera once");
    else
      views.push_back({static_cast<std::size_t>(camera - cameras.begin()), index});
  }
}

Job read_job(JsonObject& object, const std::vector<CameraOptions>& cameras) {
  Job job;
  object.read("name", job.name);
  object.read("number", job.number, 1, 65535);
  object.read("nominal_pose", job.X_WO_nominal);
  Pose X_WP = Pose::Identity();
  if (object.read_optional("planar", X_WP)) job.X_WP_planar = X_WP;
  object.read("search_mm", job.search_mm, NumberRange{0, 10000, true});
  object.read_optional("system_sigma_px", job.system_sigma_px, NumberRange{0, 100});
  object.read_each("marks", object.has("planar") ? 2 : 3, [&](JsonObject& member) {
    const NamedMark named = read_mark(member);
    add_views(member, named, cameras, job.marks.size(), job.views);
    job.marks.push_back(named.mark);
  });
  object.read_each("application_points", 1, [&](JsonObject& member) {
    job.application_points.push_back(read_application_point(member));
  });
  object.read("requirements", [&](JsonObject& member) { read_requirements(member, job.requirements); });
  object.read("limits", [&](JsonObject& member) { read_limits(member, job.requirements.limits); });
  return job;
}

// Coordinates in the world, else where its only camera saw it and how large.
ReferencePoint read_reference_place(JsonObject& object, const NamedMark& named) {
  ReferencePoint point;
  point.mark = named.mark;
  if (point.mark.kind == MarkKind::corner)
    object.add_mistake("kind", "a corner", "a round mark, a slot or a cross: a reference point is no corner");
  object.read_optional("group", point.group);
  const bool known = object.read_optional("position_mm", point.mark.p_O_mm, largest_mm);
  std::array<double, 2> taught_px{};
  const bool taught = object.read_optional("pixel", std::span<double>(taught_px), 65535.0);
  object.read_optional("diameter_px", point.taught_diameter_px, NumberRange{0, 65535, true});
  if (known) {
    if (!object.has("radius_mm"))
      object.add_mistake("radius_mm", "a point without it", "the radius of the point, mm");
    return point;
  }
  if (!object.has("position_mm") && !object.has("pixel"))
    object.add_mistake("position_mm", "neither position_mm nor pixel",
                       "coordinates in the world, or where the camera sees the point");
  if (!taught) return point;
  if (named.cameras.size() != 1)
    object.add_mistake("cameras", std::to_string(named.cameras.size()) + " cameras",
                       "the one camera that pixel belongs to");
  if (!object.has("diameter_px"))
    object.add_mistake("diameter_px", "a pixel without it", "the diameter of the point's image, px");
  point.taught_px = Eigen::Vector2d(taught_px[0], taught_px[1]);
  return point;
}

void read_reference_check(JsonObject& object, References& references) {
  object.read_optional("search_mm", references.search_mm, NumberRange{0, 1000, true});
  object.read_optional("sigma_px", references.sigma_px, NumberRange{0, 10});
  object.read_optional("tolerance_px", references.tolerance_px, NumberRange{0, 1000});
  object.read_optional("suspicious_blocks", references.suspicious_blocks);
}

void read_references(JsonObject& object, Cell& cell) {
  object.read_each_optional("reference_points", [&](JsonObject& member) {
    const NamedMark named = read_look(member);
    add_views(member, named, cell.cameras, cell.references.points.size(), cell.references.views);
    cell.references.points.push_back(read_reference_place(member, named));
  });
  object.read_optional("reference_check",
                       [&](JsonObject& member) { read_reference_check(member, cell.references); });
}

LinearAxis read_axis(JsonObject& object) {
  LinearAxis axis;
  Eigen::Vector3d given;
  if (object.read("direction", given, 2.0)) take_direction(object, "direction", given, axis.direction_W);
  object.read("zero_mm", axis.zero_mm, NumberRange{-largest_mm, largest_mm});
  return axis;
}

// The conventions that go over the wire: all but the matrix.
std::vector<std::string_view> wire_convention_names() {
  std::vector<std::string_view> names;
  for (const Convention convention : all_conventions())
    if (convention != Convention::matrix) names.push_back(name_of(convention));
  return names;
}

RobotOptions read_robot(JsonObject& object) {
  RobotOptions robot;
  object.read("name", robot.name);
  robot.link = read_link_options(object);
  const std::vector<std::string_view> conventions = wire_convention_names();
  std::size_t index = 0;
  if (object.read_word("convention", conventions, index))
    robot.convention = convention_named(conventions[index]).value_or(Convention::generic);
  if (object.read_word("frame", frame_names, index)) robot.frame = static_cast<CorrectionFrame>(index + 1);
  object.read("pose_in_world", robot.X_WR);
  object.read_optional("axis", [&](JsonObject& axis) { robot.axis = read_axis(axis); });
  read_milliseconds(object, "validity_ms", robot.validity, 50, 65535);
  return robot;
}

void read_timing(JsonObject& object, Cell& cell) {
  read_milliseconds(object, "deadline_ms", cell.deadline, 50, 60000);
  object.read_optional("zero_frames", cell.zero_frames, 1, 1000);
  read_milliseconds(object, "zero_deadline_ms", cell.zero_deadline, 50, 600000);
}

// Returns the value of "calibration".
std::string read_cell(JsonObject& object, Cell& cell) {
  std::string calibration, ignored;
  object.read_optional("$schema", ignored);
  object.read("name", cell.name);
  object.read_optional("simulated", cell.simulated);
  object.read("calibration", calibration);
  object.read_each("cameras", 1,
                   [&](JsonObject& member) { cell.cameras.push_back(read_camera_options(member)); });
  object.read_each("jobs", 1,
                   [&](JsonObject& member) { cell.jobs.push_back(read_job(member, cell.cameras)); });
  read_references(object, cell);
  object.read_each("robots", 0, [&](JsonObject& member) { cell.robots.push_back(read_robot(member)); });
  object.read_optional("timing", [&](JsonObject& member) { read_timing(member, cell); });
  return calibration;
}

void append(std::vector<std::string>& mistakes, const std::vector<std::string>& more) {
  mistakes.insert(mistakes.end(), more.begin(), more.end());
}

// The cell without its calibration; mistakes go to the list.
Cell read_cell_file(const std::string& text, const std::string& name, std::string& calibration,
                    std::vector<std::string>& mistakes) {
  Cell cell;
  try {
    const JsonValue tree = parse_json(text, name);
    JsonReading reading(name);
    read_object(tree, "", reading, [&](JsonObject& object) { calibration = read_cell(object, cell); });
    check_cell(cell, reading);
    append(mistakes, reading.mistakes());
  } catch (const ConfigError& error) {
    append(mistakes, error.mistakes());
  }
  cell.config_hash = short_hash(text);
  return cell;
}

// Orders the calibrated cameras like the cell's and checks that they fit.
void add_calibration(Cell& cell, const std::string& text, const std::string& name,
                     std::vector<std::string>& mistakes) {
  try {
    const std::vector<CalibratedCamera> calibrated = parse_cameras(text, name);
    JsonReading reading(name);
    cell.calibration = calibration_in_order(cell.cameras, calibrated, reading);
    append(mistakes, reading.mistakes());
  } catch (const ConfigError& error) {
    append(mistakes, error.mistakes());
  }
  cell.calibration_hash = short_hash(text);
}

// Points that are known by their pixel get a place on its line of sight; all must lie in the pictures.
void place_references(Cell& cell, const std::string& name, std::vector<std::string>& mistakes) {
  if (!mistakes.empty()) return;
  JsonReading reading(name);
  put_references_in_place(cell, reading);
  append(mistakes, reading.mistakes());
}

}  // namespace

Cell parse_cell(const CellText& text) {
  std::vector<std::string> mistakes;
  std::string calibration;
  Cell cell = read_cell_file(text.cell, text.cell_name, calibration, mistakes);
  add_calibration(cell, text.calibration, text.calibration_name, mistakes);
  place_references(cell, text.cell_name, mistakes);
  if (!mistakes.empty()) throw ConfigError(std::move(mistakes));
  return cell;
}

Cell load_cell(const std::filesystem::path& path) {
  std::vector<std::string> mistakes;
  std::string calibration;
  Cell cell = read_cell_file(read_file(path), path.string(), calibration, mistakes);
  if (!calibration.empty()) {
    try {
      const std::filesystem::path file = path.parent_path() / calibration;
      add_calibration(cell, read_file(file), file.string(), mistakes);
      place_references(cell, path.string(), mistakes);
    } catch (const ConfigError& error) {
      append(mistakes, error.mistakes());
    }
  }
  if (!mistakes.empty()) throw ConfigError(std::move(mistakes));
  for (CameraOptions& camera : cell.cameras)
    if (camera.driver == CameraDriver::folder) camera.folder.path = path.parent_path() / camera.folder.path;
  return cell;
}

std::set<std::string> known_cell_keys() {
  JsonReading reading = JsonReading::of_the_format();
  const JsonValue nothing;
  Cell cell;
  read_object(nothing, "", reading, [&](JsonObject& object) { read_cell(object, cell); });
  return reading.known_keys();
}

}  // namespace zeropose
