#include "config/wheel_reader.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <set>

#include "config/text.h"
#include "measure/wheel_job.h"

namespace zeropose {
namespace {

constexpr double largest_radius_mm = 2000;  // as measure_wheel() takes it
constexpr double largest_tilt_deg = 5;      // likewise
constexpr double least_apart_rad = 0.5236;  // 30 degrees between two sensors
constexpr std::size_t sensors_of_a_wheel = 3;

void read_eye(JsonObject& object, std::string_view key, const std::vector<Mounted>& cameras,
              std::size_t& index) {
  std::string camera;
  if (!object.read(key, camera)) return;
  const auto found = std::ranges::find(cameras, camera, &Mounted::camera);
  if (found == cameras.end() || !found->robot.empty())
    object.add_mistake(key, in_quotes(camera), "the name of a fixed camera of this cell");
  else
    index = static_cast<std::size_t>(found - cameras.begin());
}

WheelEyes read_eyes(JsonObject& object, const std::vector<Mounted>& cameras) {
  WheelEyes eyes;
  double angle_deg = 0;
  object.read("name", eyes.name);
  if (object.read("angle_deg", angle_deg, NumberRange{-360, 360}))
    eyes.angle_rad = angle_deg / degrees_per_radian;
  read_eye(object, "left", cameras, eyes.left);
  read_eye(object, "right", cameras, eyes.right);
  return eyes;
}

void read_lines(JsonObject& object, WheelTask& task) {
  int across = 0, control = 0;
  if (object.read("across", across, 3, 20)) task.layout.across = static_cast<std::size_t>(across);
  if (object.read("control", control, 1, 20)) task.layout.control = static_cast<std::size_t>(control - 1);
  if (across > 0 && control > across)
    object.add_mistake("control", std::to_string(control), "at most the number of lines across");
  object.read_optional("sigma_px", task.search.sigma_px, NumberRange{0.7, 10});
  object.read_optional("min_contrast", task.search.min_contrast, NumberRange{1, 255});
  object.read_optional("min_length_px", task.search.min_length_px, NumberRange{3, 1000});
  object.read_optional("max_join_px", task.search.max_join_px, NumberRange{0, 1000});
}

void read_wheel_limits(JsonObject& object, std::array<Range, 6>& limits) {
  constexpr std::array keys{"x_mm", "y_mm", "z_mm", "camber_deg", "toe_deg"};
  for (std::size_t i = 0; i < keys.size(); ++i)
    object.read_range(keys[i], limits[i].min, limits[i].max, i < 3 ? 1000 : 2 * largest_tilt_deg);
}

}  // namespace

void read_wheel(JsonObject& object, const std::vector<Mounted>& cameras, Job& job) {
  WheelTask& task = job.wheel.emplace();
  object.read("nominal_pose", job.X_WO_nominal);
  object.read_each("sensors", sensors_of_a_wheel,
                   [&](JsonObject& member) { task.sensors.push_back(read_eyes(member, cameras)); });
  object.read("lines", [&](JsonObject& lines) { read_lines(lines, task); });
  ExpectedTyre& tyre = task.tyre;
  if (object.read_range("side_wall_mm", tyre.min_radius_mm, tyre.max_radius_mm, largest_radius_mm) &&
      !(tyre.min_radius_mm > 0))
    object.add_mistake("side_wall_mm", "a radius at or below 0", "[inner, outer] radius, mm, above 0");
  object.read_optional("unevenness_mm", tyre.unevenness_mm, NumberRange{0, 10});
  object.read_optional("out_of_round_mm", tyre.out_of_round_mm, NumberRange{0, 10});
  double max_sigma_deg = 0;
  if (object.read_optional("max_sigma_deg", max_sigma_deg, NumberRange{0, 10, true}))
    task.max_sigma_rad = max_sigma_deg / degrees_per_radian;
  object.read("limits", [&](JsonObject& limits) { read_wheel_limits(limits, job.requirements.limits); });
}

void check_wheel(const WheelTask& task, const std::string& path, JsonReading& reading) {
  if (task.sensors.size() > sensors_of_a_wheel)
    reading.add_mistake(path + ".sensors", std::to_string(task.sensors.size()) + " sensors", "three");
  std::set<std::string> names;
  std::set<std::size_t> cameras;
  for (std::size_t i = 0; i < task.sensors.size(); ++i) {
    const WheelEyes& eyes = task.sensors[i];
    const std::string sensor = path_of(path + ".sensors", i);
    if (!eyes.name.empty() && !names.insert(eyes.name).second)
      reading.add_mistake(sensor + ".name", in_quotes(eyes.name) + " twice", "another one for each");
    if (!cameras.insert(eyes.left).second)
      reading.add_mistake(sensor + ".left", "a camera that another place has", "each camera once");
    if (!cameras.insert(eyes.right).second)
      reading.add_mistake(sensor + ".right", "a camera that another place has", "each camera once");
    for (std::size_t k = 0; k < i; ++k)
      if (std::abs(std::remainder(eyes.angle_rad - task.sensors[k].angle_rad, 2 * std::numbers::pi)) <
          least_apart_rad)
        reading.add_mistake(sensor + ".angle_deg",
                            concat({"less than 30 degrees from that of ", path_of(path + ".sensors", k)}),
                            "sensors all round the wheel");
  }
}

void check_wheel_sight(const Cell& cell, JsonReading& reading) {
  for (std::size_t i = 0; i < cell.jobs.size(); ++i) {
    const Job& job = cell.jobs[i];
    if (!job.wheel) continue;
    for (const std::size_t camera : cameras_of(job))
      if (!sees_its_side_wall(job, cell.calibration, camera))
        reading.add_mistake(
            path_of("jobs", i) + ".wheel",
            concat({"camera ", in_quotes(cell.cameras.at(camera).name),
                    ", which does not see the middle of the side wall at its sensor's angle"}),
            "the sensor's angle, the side wall's radii and the wheel's pose as they are");
  }
}

}  // namespace zeropose
