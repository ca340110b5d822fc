#include "config/cell_checks.h"
#include "config/gap_reader.h"
#include "config/text.h"
#include "config/wheel_reader.h"
#include "protocol/link_checks.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <sstream>

namespace zeropose {
namespace {

// As exactly as the numbers of a file can say it.
constexpr double in_plane_mm = 1e-3, in_plane_deg = 1e-4;

// Every element whose key (an empty one is left out) an earlier element has too.
template <typename Elements, typename KeyOf>
void check_unique(const Elements& elements, const std::string& path, const std::string& member, KeyOf key_of,
                  JsonReading& reading) {
  std::map<std::string, std::size_t> first;
  for (std::size_t i = 0; i < elements.size(); ++i) {
    const std::string key = key_of(elements[i]);
    if (key.empty()) continue;
    const auto [earlier, is_new] = first.try_emplace(key, i);
    if (!is_new)
      reading.add_mistake(path_of(path, i) + "." + member, key + ", as in " + path_of(path, earlier->second),
                          "another one for each");
  }
}

const auto name_in_quotes = [](const auto& element) {
  return element.name.empty() ? std::string() : in_quotes(element.name);
};

void check_cameras(const Cell& cell, JsonReading& reading) {
  check_unique(cell.cameras, "cameras", "name", name_in_quotes, reading);
  const auto unique = [&](const std::string& key, auto member) {
    check_unique(cell.cameras, "cameras", key, member, reading);
  };
  unique("address", [](const CameraOptions& camera) { return camera.gige.address; });
  unique("serial", [](const CameraOptions& camera) { return camera.gige.serial; });
  unique("user_name", [](const CameraOptions& camera) { return camera.gige.user_name; });
  unique("device", [](const CameraOptions& camera) { return camera.v4l2.device; });
}

// How many marks of a weight above 0 each camera of the job sees.
std::map<std::size_t, int> marks_per_camera(const Job& job) {
  std::map<std::size_t, int> count;
  for (const View& view : job.views) count[view.camera] += job.marks[view.mark].weight > 0 ? 1 : 0;
  return count;
}

// A sheet moves in its plane only: what does not begin in it is never found.
void check_plane(const Job& job, const std::string& path, JsonReading& reading) {
  if (!job.X_WP_planar) return;
  const SixNumbers six = to_six_numbers(job.X_WP_planar->inverse() * job.X_WO_nominal);
  const double tilt_deg = std::hypot(six.rx_deg, six.ry_deg);
  if (std::abs(six.z_mm) > in_plane_mm || tilt_deg > in_plane_deg)
    reading.add_mistake(path + ".nominal_pose",
                        concat({"a pose ", std::to_string(six.z_mm), " mm above the plane, tilted by ",
                                std::to_string(tilt_deg), " deg"}),
                        "one that lies in the plane of planar (its z, rx and ry are 0 there)");
}

void check_requirements(const Cell& cell, const Job& job, const std::string& path, JsonReading& reading) {
  const Requirements& needed = job.requirements;
  if (needed.min_marks < least_marks(job))
    reading.add_mistake(path + ".requirements.min_marks", std::to_string(needed.min_marks),
                        "at least 3; 2 suffice in a job that is planar");
  const auto marks = std::ranges::count_if(job.marks, [](const Mark& mark) { return mark.weight > 0; });
  if (static_cast<int>(job.marks.size()) >= least_marks(job) && needed.min_marks > marks)
    reading.add_mistake(path + ".requirements.min_marks", std::to_string(needed.min_marks),
                        concat({"at most the ", std::to_string(marks), " marks with a weight above 0"}));
  const std::map<std::size_t, int> per_camera = marks_per_camera(job);
  if (per_camera.empty()) return;
  const auto useful = std::ranges::count_if(per_camera, [](const auto& camera) { return camera.second > 0; });
  if (needed.min_cameras > useful)
    reading.add_mistake(
        path + ".requirements.min_cameras", std::to_string(needed.min_cameras),
        concat({"at most the ", std::to_string(useful), " cameras that see marks with a weight above 0"}));
  for (const auto& [camera, count] : per_camera)
    if (needed.min_marks_per_camera > count)
      reading.add_mistake(path + ".requirements.min_marks_per_camera",
                          std::to_string(needed.min_marks_per_camera),
                          concat({"at most the ", std::to_string(count), " marks with a weight above 0 of ",
                                  in_quotes(camera_name(cell, job, camera))}));
}

// A picture from where nothing is looked for would be asked of the robot for nothing.
void check_positions(const Cell& cell, const Job& job, const std::string& path, JsonReading& reading) {
  std::set<std::size_t> used;
  const std::vector<HandEye> eyes = hand_eyes(job);
  for (const View& view : job.views)
    if (view.camera >= cell.cameras.size()) used.insert(eyes[view.camera - cell.cameras.size()].position);
  for (std::size_t i = 0; i < job.positions.size(); ++i)
    if (!used.contains(i))
      reading.add_mistake(path_of(path + ".positions", i) + ".name", in_quotes(job.positions[i].name),
                          "a position that at least one mark names in its cameras");
}

void check_jobs(const Cell& cell, JsonReading& reading) {
  check_unique(cell.jobs, "jobs", "name", name_in_quotes, reading);
  check_unique(
      cell.jobs, "jobs", "number",
      [](const Job& job) { return job.number == 0 ? std::string() : std::to_string(job.number); }, reading);
  for (std::size_t i = 0; i < cell.jobs.size(); ++i) {
    const std::string path = path_of("jobs", i);
    if (cell.jobs[i].gaps) {
      check_gaps(cell, cell.jobs[i], path + ".gaps", reading);
      continue;
    }
    if (cell.jobs[i].wheel) {
      check_wheel(*cell.jobs[i].wheel, path + ".wheel", reading);
      continue;
    }
    check_unique(cell.jobs[i].marks, path + ".marks", "name", name_in_quotes, reading);
    check_unique(cell.jobs[i].positions, path + ".positions", "name", name_in_quotes, reading);
    check_positions(cell, cell.jobs[i], path, reading);
    check_unique(cell.jobs[i].application_points, path + ".application_points", "name", name_in_quotes,
                 reading);
    check_plane(cell.jobs[i], path, reading);
    check_requirements(cell, cell.jobs[i], path, reading);
  }
}

// Robots of one address and port have a unit id each. Two servers cannot listen on one port; 0.0.0.0 takes
// the port of every address.
void check_ports(const ModbusTcpOptions& tcp, const ModbusTcpOptions& other, const std::string& path,
                 const std::string& other_path, JsonReading& reading) {
  const std::string every = "0.0.0.0";
  if (tcp.port == 0 || tcp.address.empty() || other.address.empty() || tcp.port != other.port) return;
  const std::string place = tcp.address + ":" + std::to_string(tcp.port);
  const std::string as_in = ", as in " + other_path;
  if (tcp.address != other.address) {
    if (tcp.address == every || other.address == every)
      reading.add_mistake(path + ".port", place + as_in, "a port of its own for each address");
  } else if (tcp.robot.unit.unit == other.robot.unit.unit) {
    reading.add_mistake(path + ".unit", place + " unit " + std::to_string(tcp.robot.unit.unit) + as_in,
                        "a port or a unit id of its own for each robot");
  }
}

void check_places(const CanOptions& can, const CanOptions& other, const std::string& path,
                  const std::string& other_path, JsonReading& reading) {
  if (can.interface == other.interface && can.node == other.node)
    reading.add_mistake(path + ".node",
                        can.interface + " node " + std::to_string(can.node) + ", as in " + other_path,
                        "a node of its own for each robot");
}

void check_places(const ModbusTcpOptions& tcp, const ModbusTcpOptions& other, const std::string& path,
                  const std::string& other_path, JsonReading& reading) {
  check_ports(tcp, other, path, other_path, reading);
}

// Two robots' blocks on one controller would overwrite each other.
void check_places(const ModbusClientOptions& client, const ModbusClientOptions& other,
                  const std::string& path, const std::string& other_path, JsonReading& reading) {
  const auto* tcp = std::get_if<ModbusTcpAddress>(&client.where);
  const auto* other_tcp = std::get_if<ModbusTcpAddress>(&other.where);
  if (tcp == nullptr || other_tcp == nullptr || tcp->address.empty()) return;
  if (tcp->address == other_tcp->address && tcp->port == other_tcp->port && client.unit == other.unit)
    reading.add_mistake(path + ".address", describe(client) + ", as in " + other_path,
                        "a controller, or a unit of it, of its own for each robot");
}

void check_places(const ModbusRtuOptions&, const ModbusRtuOptions&, const std::string&, const std::string&,
                  JsonReading&) {}

// The serial device of a link; empty: it has none.
std::string device_of(const LinkOptions& link) {
  if (const auto* rtu = std::get_if<ModbusRtuOptions>(&link)) return rtu->line.device;
  const auto* client = std::get_if<ModbusClientOptions>(&link);
  const auto* line = client != nullptr ? std::get_if<SerialLine>(&client->where) : nullptr;
  return line != nullptr ? line->device : std::string();
}

// No two robots in one place.
void check_places(const std::vector<RobotOptions>& robots, JsonReading& reading) {
  for (std::size_t i = 0; i < robots.size(); ++i)
    for (std::size_t j = 0; j < i; ++j) {
      const std::string device = device_of(robots[i].link);
      if (!device.empty() && device == device_of(robots[j].link))
        reading.add_mistake(path_of("robots", i) + ".link.device",
                            in_quotes(device) + ", as in " + path_of("robots", j) + ".link",
                            "a serial line of its own for each robot");
      std::visit(
          [&]<class Link>(const Link& link) {
            if (const auto* other = std::get_if<Link>(&robots[j].link))
              check_places(link, *other, path_of("robots", i) + ".link", path_of("robots", j) + ".link",
                           reading);
          },
          robots[i].link);
    }
}

void check_lists(const ModbusTcpRobot& robot, const std::string& path, JsonReading& reading) {
  const std::set<std::string> writers(robot.allowed_writers.begin(), robot.allowed_writers.end());
  for (std::size_t j = 0; j < robot.allowed_readers.size(); ++j)
    if (writers.contains(robot.allowed_readers[j]))
      reading.add_mistake(path_of(path + ".allowed_readers", j),
                          in_quotes(robot.allowed_readers[j]) + ", as in allowed_writers",
                          "each address in one of the two lists");
}

// Rz Ry Rz: next to no turn at all the first angle is anything up to 180 degrees.
bool has_large_angles(Convention convention) {
  return convention == Convention::kawasaki || convention == Convention::comau ||
         convention == Convention::adept || convention == Convention::doosan;
}

void check_can(const CanOptions& can, Convention convention, const std::string& path, JsonReading& reading) {
  constexpr double least_for_large_angles_deg = 0.0055;  // 180 degrees in an int16
  const std::string name(name_of(convention));
  if (!fits_can(convention))
    reading.add_mistake(path + ".convention", in_quotes(name),
                        "a convention with three lengths and three angles for a link of type can");
  if (fits_can(convention) && !can.fd && has_large_angles(convention) &&
      can.angle_scale_deg < least_for_large_angles_deg) {
    std::ostringstream found;
    found << can.angle_scale_deg;
    reading.add_mistake(path + ".link.angle_scale_deg", found.str(),
                        "0.01, since the angles of convention " + name + " reach 180 degrees");
  }
}

// A command on CAN has eight bytes: no argument, and one byte for the job.
void check_what_can_carries(const RobotOptions& robot, const std::vector<Job>& jobs, const std::string& path,
                            JsonReading& reading) {
  if (robot.axis)
    reading.add_mistake(path + ".axis", "a linear axis with a link of type can",
                        "another link, since a command on CAN cannot tell the position of the axis");
  for (const Job& job : jobs)
    if (job.number > 255)
      reading.add_mistake(path + ".link", "job " + std::to_string(job.number),
                          "job numbers up to 255 with a link of type can");
}

// What only shows when all keys are there; not said of a link that has mistakes already.
void check_whole(const LinkOptions& link, const std::string& path, JsonReading& reading) {
  if (!reading.mistakes().empty()) return;
  try {
    if (const auto* rtu = std::get_if<ModbusRtuOptions>(&link)) check(*rtu);
    if (const auto* client = std::get_if<ModbusClientOptions>(&link)) check(*client);
  } catch (const std::invalid_argument& error) {
    reading.add_mistake(path, describe(link), error.what());
  }
}

void check_robots(const Cell& cell, JsonReading& reading) {
  check_unique(cell.robots, "robots", "name", name_in_quotes, reading);
  check_places(cell.robots, reading);
  for (std::size_t i = 0; i < cell.robots.size(); ++i) {
    const RobotOptions& robot = cell.robots[i];
    const std::string path = path_of("robots", i);
    if (const auto* tcp = std::get_if<ModbusTcpOptions>(&robot.link)) check_lists(tcp->robot, path, reading);
    if (const auto* can = std::get_if<CanOptions>(&robot.link)) {
      check_can(*can, robot.convention, path, reading);
      check_what_can_carries(robot, cell.jobs, path, reading);
    }
    check_whole(robot.link, path + ".link", reading);
  }
}

// Where the hand is comes with AtPosition, which only the Modbus servers take and which has no place for the
// axis.
void check_hands(const Cell& cell, JsonReading& reading) {
  for (std::size_t i = 0; i < cell.hand_of.size(); ++i) {
    if (!cell.hand_of[i]) continue;
    const RobotOptions& robot = cell.robots[*cell.hand_of[i]];
    const bool server = std::holds_alternative<ModbusTcpOptions>(robot.link) ||
                        std::holds_alternative<ModbusRtuOptions>(robot.link);
    if (!server || robot.axis)
      reading.add_mistake(path_of("cameras", i) + ".on_hand_of", in_quotes(robot.name),
                          "a robot without a linear axis, on a link of type modbus-tcp or modbus-rtu");
  }
}

bool reaches_corners(const CameraModel& model) {
  for (const double u : {-0.5, model.width_px - 0.5})
    for (const double v : {-0.5, model.height_px - 0.5})
      if (!ray(model, {u, v})) return false;
  return true;
}

std::string size_text(int width_px, int height_px) {
  return std::to_string(width_px) + " x " + std::to_string(height_px) + " px";
}

}  // namespace

void check_cell(const Cell& cell, JsonReading& reading) {
  check_cameras(cell, reading);
  check_jobs(cell, reading);
  check_unique(
      cell.references.points, "reference_points", "name",
      [](const ReferencePoint& point) {
        return point.mark.name.empty() ? std::string() : in_quotes(point.mark.name);
      },
      reading);
  check_robots(cell, reading);
  check_hands(cell, reading);
  if (cell.zero_deadline < cell.deadline)
    reading.add_mistake("timing.zero_deadline_ms", std::to_string(cell.zero_deadline.count()),
                        concat({"at least deadline_ms, ", std::to_string(cell.deadline.count())}));
}

void put_references_in_place(Cell& cell, JsonReading& reading) {
  constexpr double taught_distance_mm = 2500;  // any will do: what is searched and compared are pixels
  for (const View& view : cell.references.views) {
    ReferencePoint& point = cell.references.points[view.mark];
    const CalibratedCamera& camera = cell.calibration[view.camera];
    const std::string path = path_of("reference_points", view.mark);
    if (point.taught_px) {
      const auto direction = ray(camera.model, *point.taught_px);
      if (!direction || !in_image(camera.model, *point.taught_px)) {
        reading.add_mistake(path + ".pixel", "a pixel outside the picture",
                            concat({"one in the picture of ", in_quotes(camera.name)}));
        continue;
      }
      point.mark.p_O_mm = camera.X_WC * (taught_distance_mm * *direction);
      const double radius_mm = point.taught_diameter_px / 2 * taught_distance_mm / camera.model.fx_px;
      for (double& inner_mm : point.mark.inner_radii_mm) inner_mm *= radius_mm / point.mark.radius_mm;
      point.mark.radius_mm = radius_mm;
      continue;
    }
    const auto u_px = project(camera.model, camera.X_WC.inverse() * point.mark.p_O_mm);
    if (!u_px || !in_image(camera.model, *u_px))
      reading.add_mistake(path + ".position_mm", "a point outside the picture",
                          concat({"one in the picture of ", in_quotes(camera.name)}));
  }
}

std::vector<CalibratedCamera> calibration_in_order(const Cell& cell,
                                                   std::span<const CalibratedCamera> calibrated,
                                                   JsonReading& reading) {
  std::vector<CalibratedCamera> ordered;
  for (std::size_t i = 0; i < cell.cameras.size(); ++i) {
    const CameraOptions& camera = cell.cameras[i];
    if (camera.name.empty()) continue;
    const auto found = std::ranges::find(calibrated, camera.name, &CalibratedCamera::name);
    if (found == calibrated.end()) {
      reading.add_mistake(camera.name, "no such key", "the calibration of this camera of the cell");
      continue;
    }
    if (found->on_hand != cell.hand_of[i].has_value())
      reading.add_mistake(camera.name, found->on_hand ? "X_HC" : "X_WC",
                          found->on_hand ? "X_WC, since the cell has the camera fixed"
                                         : "X_HC, since the camera is on the hand of a robot");
    const CameraModel& model = found->model;
    const bool size_known = camera.width_px > 0 && camera.height_px > 0;
    if (size_known && (model.width_px != camera.width_px || model.height_px != camera.height_px))
      reading.add_mistake(camera.name, size_text(model.width_px, model.height_px),
                          concat({"the camera's ", size_text(camera.width_px, camera.height_px)}));
    if (!reaches_corners(model))
      reading.add_mistake(camera.name, "a lens model that gives no direction for a corner of the image",
                          "one that holds for the whole image");
    ordered.push_back(*found);
  }
  return ordered;
}

}  // namespace zeropose
