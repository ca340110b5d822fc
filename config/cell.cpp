#include "config/cell.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>

#include "config/camera_options.h"
#include "config/cameras.h"
#include "config/cell_checks.h"
#include "config/files.h"
#include "config/gap_reader.h"
#include "config/ipv4.h"
#include "config/job_reader.h"
#include "config/json_reader.h"
#include "config/robot_link.h"
#include "config/text.h"
#include "config/wheel_reader.h"

namespace zeropose {
namespace {

constexpr std::array<std::string_view, 4> frame_names{"object_zero", "world_shift", "robot_base_shift",
                                                      "user_frame"};

void read_milliseconds(JsonObject& object, std::string_view key, std::chrono::milliseconds& value, int min,
                       int max) {
  int count = static_cast<int>(value.count());
  if (object.read_optional(key, count, min, max)) value = std::chrono::milliseconds(count);
}

// Coordinates in the world, else where its only camera saw it and how large.
ReferencePoint read_reference_place(JsonObject& object, const NamedMark& named) {
  ReferencePoint point;
  point.mark = named.mark;
  if (point.mark.kind == MarkKind::corner)
    object.add_mistake("kind", "a corner", "a round mark, a slot or a cross: a reference point is no corner");
  object.read_optional("group", point.group);
  const bool known = object.read_optional("position_mm", point.mark.p_O_mm, largest_coordinate_mm);
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

void read_references(JsonObject& object, const Eyes& eyes, Cell& cell) {
  object.read_each_optional("reference_points", [&](JsonObject& member) {
    const NamedMark named = read_look(member);
    add_views(member, named, eyes, cell.references.points.size(), cell.references.views);
    cell.references.points.push_back(read_reference_place(member, named));
  });
  object.read_optional("reference_check",
                       [&](JsonObject& member) { read_reference_check(member, cell.references); });
}

LinearAxis read_axis(JsonObject& object) {
  LinearAxis axis;
  Eigen::Vector3d given;
  if (object.read("direction", given, 2.0)) take_direction(object, "direction", given, axis.direction_W);
  object.read("zero_mm", axis.zero_mm, NumberRange{-largest_coordinate_mm, largest_coordinate_mm});
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

// Which robot carries which camera, once both are read.
void find_hands(JsonObject& object, const std::vector<Mounted>& cameras, Cell& cell) {
  for (std::size_t i = 0; i < cameras.size(); ++i) {
    cell.hand_of.emplace_back();
    if (cameras[i].robot.empty()) continue;
    const auto robot = std::ranges::find(cell.robots, cameras[i].robot, &RobotOptions::name);
    if (robot == cell.robots.end())
      object.add_mistake(path_of("cameras", i) + ".on_hand_of", in_quotes(cameras[i].robot),
                         "the name of a robot of this cell");
    else
      cell.hand_of[i] = static_cast<std::size_t>(robot - cell.robots.begin());
  }
}

// Returns the value of "calibration".
std::string read_cell(JsonObject& object, Cell& cell) {
  std::string calibration, ignored;
  object.read_optional("$schema", ignored);
  object.read("name", cell.name);
  object.read_optional("simulated", cell.simulated);
  object.read("calibration", calibration);
  std::vector<Mounted> mounted;
  object.read_each("cameras", 1, [&](JsonObject& member) {
    cell.cameras.push_back(read_camera_options(member));
    mounted.push_back({cell.cameras.back().name, ""});
    member.read_optional("on_hand_of", mounted.back().robot);
  });
  object.read_each("jobs", 1, [&](JsonObject& member) { cell.jobs.push_back(read_job(member, mounted)); });
  read_references(object, fixed_eyes(mounted), cell);
  object.read_each("robots", 0, [&](JsonObject& member) { cell.robots.push_back(read_robot(member)); });
  find_hands(object, mounted, cell);
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
    cell.calibration = calibration_in_order(cell, calibrated, reading);
    append(mistakes, reading.mistakes());
  } catch (const ConfigError& error) {
    append(mistakes, error.mistakes());
  }
  cell.calibration_hash = short_hash(text);
}

// Points that are known by their pixel get a place on its line of sight; all must lie in the pictures. Planes
// of gaps and side walls must be seen.
void check_with_calibration(Cell& cell, const std::string& name, std::vector<std::string>& mistakes) {
  if (!mistakes.empty()) return;
  JsonReading reading(name);
  put_references_in_place(cell, reading);
  check_gap_planes(cell, reading);
  check_wheel_sight(cell, reading);
  append(mistakes, reading.mistakes());
}

}  // namespace

Cell parse_cell(const CellText& text) {
  std::vector<std::string> mistakes;
  std::string calibration;
  Cell cell = read_cell_file(text.cell, text.cell_name, calibration, mistakes);
  add_calibration(cell, text.calibration, text.calibration_name, mistakes);
  check_with_calibration(cell, text.cell_name, mistakes);
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
      cell.calibration_file = file;
      add_calibration(cell, read_file(file), file.string(), mistakes);
      check_with_calibration(cell, path.string(), mistakes);
    } catch (const ConfigError& error) {
      append(mistakes, error.mistakes());
    }
  }
  if (!mistakes.empty()) throw ConfigError(std::move(mistakes));
  for (CameraOptions& camera : cell.cameras)
    if (camera.driver == CameraDriver::folder) camera.folder.path = path.parent_path() / camera.folder.path;
  return cell;
}

std::filesystem::path calibration_file_of(const std::filesystem::path& path) {
  std::vector<std::string> mistakes;
  std::string calibration;
  read_cell_file(read_file(path), path.string(), calibration, mistakes);
  if (calibration.empty()) throw ConfigError(std::move(mistakes));
  return path.parent_path() / calibration;
}

std::vector<CalibratedCamera> cameras_for(const Cell& cell, const Job& job, std::span<const Pose> X_RH) {
  std::vector<CalibratedCamera> cameras = cell.calibration;
  for (const HandEye& eye : hand_eyes(job)) {
    const Pose& X_WR = cell.robots.at(cell.hand_of.at(eye.camera).value()).X_WR;
    const Pose& X_RH_there = X_RH.empty() ? job.positions[eye.position].X_RH : X_RH[eye.position];
    cameras.push_back(virtual_camera(cell.calibration.at(eye.camera), X_WR * X_RH_there));
    cameras.back().name = camera_name(cell, job, cameras.size() - 1);
  }
  return cameras;
}

std::string camera_name(const Cell& cell, const Job& job, std::size_t view_camera) {
  if (view_camera < cell.cameras.size()) return cell.cameras[view_camera].name;
  const HandEye eye = hand_eyes(job).at(view_camera - cell.cameras.size());
  return cell.cameras.at(eye.camera).name + " at " + job.positions[eye.position].name;
}

std::set<std::string> known_cell_keys() {
  JsonReading reading = JsonReading::of_the_format();
  const JsonValue nothing;
  Cell cell;
  read_object(nothing, "", reading, [&](JsonObject& object) { read_cell(object, cell); });
  return reading.known_keys();
}

}  // namespace zeropose
