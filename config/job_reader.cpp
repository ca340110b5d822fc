#include "config/job_reader.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <string_view>

#include "config/gap_reader.h"
#include "config/text.h"
#include "config/wheel_reader.h"

namespace zeropose {
namespace {

// In pairs of one kind, dark and bright.
constexpr std::array<std::string_view, 12> mark_kind_names{
    "dark_disc", "bright_disc", "dark_ring",  "bright_ring",  "dark_ball",   "bright_ball",
    "dark_slot", "bright_slot", "dark_cross", "bright_cross", "dark_corner", "bright_corner"};
constexpr std::array mark_kinds{MarkKind::disc, MarkKind::ring,  MarkKind::ball,
                                MarkKind::slot, MarkKind::cross, MarkKind::corner};

void read_normal(JsonObject& object, Eigen::Vector3d& normal_O) {
  Eigen::Vector3d given;
  if (object.read_optional("normal", given, 2.0)) take_direction(object, "normal", given, normal_O);
}

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

NamedMark read_mark(JsonObject& object) {
  NamedMark named = read_look(object);
  Mark& mark = named.mark;
  read_edges(object, mark);
  object.read("position_mm", mark.p_O_mm, largest_coordinate_mm);
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
  object.read("position_mm", point.p_O_mm, largest_coordinate_mm);
  return point;
}

// The cameras of a position: all on the hand of one robot.
void read_position_cameras(JsonObject& object, const std::vector<Mounted>& cameras, HandPosition& position) {
  std::vector<std::string> names;
  if (!object.read("cameras", names)) return;
  if (names.empty())
    object.add_mistake("cameras", "no camera", "the names of cameras with on_hand_of, all of one robot");
  for (std::size_t i = 0; i < names.size(); ++i) {
    const std::string key = path_of("cameras", i);
    const auto found = std::ranges::find(cameras, names[i], &Mounted::camera);
    const auto index = static_cast<std::size_t>(found - cameras.begin());
    if (found == cameras.end() || found->robot.empty())
      object.add_mistake(key, in_quotes(names[i]), "the name of a camera with on_hand_of");
    else if (std::ranges::find(position.cameras, index) != position.cameras.end())
      object.add_mistake(key, in_quotes(names[i]) + " twice", "each camera once");
    else if (!position.cameras.empty() && cameras[position.cameras.front()].robot != found->robot)
      object.add_mistake(key, in_quotes(names[i]), "a camera on the same hand as the first one");
    else
      position.cameras.push_back(index);
  }
}

HandPosition read_position(JsonObject& object, const std::vector<Mounted>& cameras) {
  HandPosition position;
  object.read("name", position.name);
  if (std::ranges::find(cameras, position.name, &Mounted::camera) != cameras.end())
    object.add_mistake("name", in_quotes(position.name), "a name that no camera has");
  read_position_cameras(object, cameras, position);
  object.read("hand_pose", position.X_RH);
  object.read_optional("tolerance_mm", position.tolerance_mm, NumberRange{0, 1000, true});
  object.read_optional("tolerance_deg", position.tolerance_deg, NumberRange{0, 180, true});
  return position;
}

// A job looks at marks, evens gaps or measures a wheel; `kind` is the key of what it does instead of marks.
void refuse_keys_of_others(JsonObject& object, std::string_view kind) {
  for (const char* key :
       {"gaps", "wheel", "nominal_pose", "planar", "positions", "positions_within_s", "search_mm",
        "system_sigma_px", "marks", "application_points", "requirements", "limits"}) {
    if (key == kind) continue;
    object.skip(key);
    if (object.has(key))
      object.add_mistake(key, concat({"a key of another kind of job beside ", kind}), "one kind of job");
  }
}

// Returns what the job's marks can be seen from.
Eyes read_positions(JsonObject& object, const std::vector<Mounted>& cameras, Job& job) {
  object.read_each_optional(
      "positions", [&](JsonObject& member) { job.positions.push_back(read_position(member, cameras)); });
  object.read_optional("positions_within_s", job.positions_within_s, NumberRange{0, 3600, true});
  Eyes eyes = fixed_eyes(cameras);
  for (const HandEye& eye : hand_eyes(job)) eyes.push_back(job.positions[eye.position].name);
  return eyes;
}

}  // namespace

void take_direction(JsonObject& object, std::string_view key, const Eigen::Vector3d& given,
                    Eigen::Vector3d& direction) {
  if (std::abs(given.norm() - 1) > 0.01)
    object.add_mistake(key, concat({"a vector of length ", std::to_string(given.norm())}),
                       "a unit vector (length 0.99 to 1.01)");
  else
    direction = given.normalized();
}

// The inner radius is read after the radius.
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

void add_views(JsonObject& object, const NamedMark& named, const Eyes& eyes, std::size_t index,
               std::vector<View>& views) {
  constexpr const char* expected = "the name of a fixed camera of this cell, or of a position of this job";
  if (object.has("cameras") && named.cameras.empty()) object.add_mistake("cameras", "no camera", expected);
  for (std::size_t i = 0; i < named.cameras.size(); ++i) {
    const std::string& name = named.cameras[i];
    const std::string key = path_of("cameras", i);
    if (name.empty() || std::ranges::find(eyes, name) == eyes.end())
      object.add_mistake(key, in_quotes(name), expected);
    else if (std::find(named.cameras.begin(), named.cameras.begin() + static_cast<std::ptrdiff_t>(i), name) !=
             named.cameras.begin() + static_cast<std::ptrdiff_t>(i))
      object.add_mistake(key, in_quotes(name) + " twice", "each camera once");
    else
      for (std::size_t eye = 0; eye < eyes.size(); ++eye)
        if (eyes[eye] == name) views.push_back({eye, index});
  }
}

Eyes fixed_eyes(const std::vector<Mounted>& cameras) {
  Eyes eyes;
  for (const Mounted& mounted : cameras) eyes.push_back(mounted.robot.empty() ? mounted.camera : "");
  return eyes;
}

Job read_job(JsonObject& object, const std::vector<Mounted>& cameras) {
  Job job;
  object.read("name", job.name);
  object.read("number", job.number, 1, 65535);
  if (object.read_optional("gaps", [&](JsonObject& member) { job.gaps = read_gaps(member, cameras); })) {
    refuse_keys_of_others(object, "gaps");
    return job;
  }
  job.gaps.reset();
  if (object.read_optional("wheel", [&](JsonObject& member) { read_wheel(member, cameras, job); })) {
    refuse_keys_of_others(object, "wheel");
    return job;
  }
  job.wheel.reset();
  object.read("nominal_pose", job.X_WO_nominal);
  Pose X_WP = Pose::Identity();
  if (object.read_optional("planar", X_WP)) job.X_WP_planar = X_WP;
  const Eyes eyes = read_positions(object, cameras, job);
  object.read("search_mm", job.search_mm, NumberRange{0, 10000, true});
  object.read_optional("system_sigma_px", job.system_sigma_px, NumberRange{0, 100});
  if (!object.has("marks")) object.add_mistake("marks", "no such key", "the job's marks, or gaps, or wheel");
  object.read_each_optional("marks", object.has("planar") ? 2 : 3, [&](JsonObject& member) {
    const NamedMark named = read_mark(member);
    add_views(member, named, eyes, job.marks.size(), job.views);
    job.marks.push_back(named.mark);
  });
  object.read_each("application_points", 1, [&](JsonObject& member) {
    job.application_points.push_back(read_application_point(member));
  });
  object.read("requirements", [&](JsonObject& member) { read_requirements(member, job.requirements); });
  object.read("limits", [&](JsonObject& member) { read_limits(member, job.requirements.limits); });
  return job;
}

}  // namespace zeropose
