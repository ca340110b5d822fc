#include "config/gap_reader.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <set>

#include "config/text.h"

namespace zeropose {
namespace {

constexpr std::array<std::string_view, 2> sense_names{"dark_to_bright", "bright_to_dark"};
constexpr double largest_px = 65535;

void read_degrees(JsonObject& object, std::string_view key, double& value_rad, NumberRange range_deg) {
  double value_deg = 0;
  if (object.read_optional(key, value_deg, range_deg)) value_rad = value_deg / degrees_per_radian;
}

void read_sense(JsonObject& object, std::string_view key, EdgeSense& sense) {
  std::size_t index = 0;
  if (object.read_word(key, sense_names, index))
    sense = index == 0 ? EdgeSense::dark_to_bright : EdgeSense::bright_to_dark;
}

void read_window(JsonObject& object, GapSearch& search) {
  object.read("centre_px", std::span<double>(search.centre_px.data(), 2), largest_px);
  double direction_deg = 0;
  if (object.read("direction_deg", direction_deg, NumberRange{-360, 360}))
    search.direction_rad = direction_deg / degrees_per_radian;
  object.read("half_across_px", search.half_across_px, NumberRange{4, largest_px});
  object.read("half_along_px", search.half_along_px, NumberRange{4, largest_px});
}

void read_edges(JsonObject& object, GapSearch& search) {
  read_sense(object, "frame", search.frame);
  read_sense(object, "pane", search.pane);
  read_degrees(object, "direction_tolerance_deg", search.direction_tolerance_rad, {0, 57, true});
  read_degrees(object, "max_wedge_deg", search.max_wedge_rad, {0, 57, true});
  object.read_optional("min_length_share", search.min_length_share, NumberRange{0, 1, true});
  object.read_optional("min_contrast", search.min_contrast, NumberRange{0, 255, true});
  object.read_optional("max_blur_px", search.max_blur_px, NumberRange{0, 100, true});
}

GapPlane read_plane(JsonObject& object) {
  GapPlane plane;
  Eigen::Vector3d normal;
  object.read("point_mm", plane.p_H_mm, largest_coordinate_mm);
  if (object.read("normal", normal, 2.0)) take_direction(object, "normal", normal, plane.n_H);
  return plane;
}

GapView read_gap(JsonObject& object, const std::vector<Mounted>& cameras, const GapPlane& plane_of_pane) {
  GapView gap;
  std::string camera;
  object.read("name", gap.name);
  if (object.read("camera", camera)) {
    const auto found = std::ranges::find(cameras, camera, &Mounted::camera);
    if (found == cameras.end() || found->robot.empty())
      object.add_mistake("camera", in_quotes(camera), "the name of a camera with on_hand_of");
    else
      gap.camera = static_cast<std::size_t>(found - cameras.begin());
  }
  object.read("window", [&](JsonObject& window) { read_window(window, gap.search); });
  read_edges(object, gap.search);
  if (object.read_range("gap_mm", gap.search.min_gap_mm, gap.search.max_gap_mm, 1000) &&
      !(gap.search.min_gap_mm > 0))
    object.add_mistake("gap_mm", "a range that begins at or below 0", "[min, max] with 0 < min < max, mm");
  gap.plane = plane_of_pane;
  object.read_optional("plane", [&](JsonObject& plane) { gap.plane = read_plane(plane); });
  object.read_optional("weight", gap.weight, NumberRange{0, 1});
  object.read_optional("wanted_mm", gap.wanted_mm, NumberRange{-1000, 1000});
  return gap;
}

void read_motion(JsonObject& object, GapTask& task) {
  double rz_deg = 0;
  object.read("x_mm", task.max_x_mm, NumberRange{0, 1000, true});
  object.read("y_mm", task.max_y_mm, NumberRange{0, 1000, true});
  if (object.read("rz_deg", rz_deg, NumberRange{0, 90, true})) task.max_rz_rad = rz_deg / degrees_per_radian;
}

// The corners of the window, turned as it is.
bool lies_inside(const GapSearch& search, const CameraOptions& camera) {
  const Eigen::Vector2d across(std::cos(search.direction_rad), std::sin(search.direction_rad));
  const Eigen::Vector2d along(-across.y(), across.x());
  for (const double a : {-search.half_across_px, search.half_across_px})
    for (const double l : {-search.half_along_px, search.half_along_px}) {
      const Eigen::Vector2d corner = search.centre_px + a * across + l * along;
      if (corner.minCoeff() < -0.5 || corner.x() > camera.width_px - 0.5 ||
          corner.y() > camera.height_px - 0.5)
        return false;
    }
  return true;
}

void check_gap(const Cell& cell, const GapView& gap, const std::string& path, JsonReading& reading) {
  if (gap.camera >= cell.cameras.size()) return;  // there are none
  const CameraOptions& camera = cell.cameras[gap.camera];
  const bool known = camera.width_px > 0 && camera.height_px > 0 && gap.search.half_across_px > 0;
  if (known && !lies_inside(gap.search, camera))
    reading.add_mistake(path + ".window", "a window that reaches beyond the image",
                        concat({"one within the ", std::to_string(camera.width_px), " x ",
                                std::to_string(camera.height_px), " px of ", in_quotes(camera.name)}));
}

void check_counts(const GapTask& task, const std::string& path, JsonReading& reading) {
  const auto weighted =
      static_cast<int>(std::ranges::count_if(task.gaps, [](const GapView& gap) { return gap.weight > 0; }));
  const int least = task.even ? 4 : 3;
  if (weighted < least)
    reading.add_mistake(path + ".places", std::to_string(weighted) + " gaps with a weight above 0",
                        "at least 4 to even them (x, y, rz and the common gap), 3 with even: false");
  else if (task.min_gaps < least || task.min_gaps > weighted)
    reading.add_mistake(path + ".min_gaps", std::to_string(task.min_gaps),
                        concat({"from ", std::to_string(least), " to the ", std::to_string(weighted),
                                " gaps with a weight above 0"}));
}

// The motion is one of the pane, so it is for the robot that carries it, and in the pane's frame.
void check_hand(const Cell& cell, const GapTask& task, const std::string& path, JsonReading& reading) {
  std::set<std::size_t> robots;
  for (const GapView& gap : task.gaps)
    if (gap.camera < cell.hand_of.size() && cell.hand_of[gap.camera])
      robots.insert(*cell.hand_of[gap.camera]);
  if (robots.size() > 1)
    reading.add_mistake(path + ".places", "cameras on the hands of several robots",
                        "cameras on the hand that carries the pane");
  for (const std::size_t robot : robots)
    if (cell.robots[robot].frame != CorrectionFrame::object_zero)
      reading.add_mistake(
          path_of("robots", robot) + ".frame", "another frame than object_zero",
          concat({"object_zero, since the motion of ", path, " is told in the pane's frame"}));
}

}  // namespace

GapTask read_gaps(JsonObject& object, const std::vector<Mounted>& cameras) {
  GapTask task;
  object.read("pane_in_hand", task.X_HT);
  const GapPlane plane{task.X_HT.translation(), task.X_HT.linear().col(2)};
  object.read_optional("even", task.even);
  object.read("min_gaps", task.min_gaps, 3, 1000);
  object.read_optional("shape_sigma_mm", task.shape_sigma_mm, NumberRange{0, 100});
  object.read_optional("tolerance_mm", task.tolerance_mm, NumberRange{0, 100, true});
  object.read_optional("max_sigma_mm", task.max_sigma_mm, NumberRange{0, 100, true});
  object.read("max_motion", [&](JsonObject& motion) { read_motion(motion, task); });
  object.read_each("places", 3,
                   [&](JsonObject& member) { task.gaps.push_back(read_gap(member, cameras, plane)); });
  return task;
}

void check_gaps(const Cell& cell, const Job& job, const std::string& path, JsonReading& reading) {
  const GapTask& task = *job.gaps;
  std::set<std::string> names;
  for (std::size_t i = 0; i < task.gaps.size(); ++i) {
    const std::string place = path_of(path + ".places", i);
    if (!task.gaps[i].name.empty() && !names.insert(task.gaps[i].name).second)
      reading.add_mistake(place + ".name", in_quotes(task.gaps[i].name) + " twice", "another one for each");
    check_gap(cell, task.gaps[i], place, reading);
  }
  check_counts(task, path, reading);
  check_hand(cell, task, path, reading);
}

// An empty picture has no edges; what is refused before they are looked for is wrong with the numbers.
void check_gap_planes(const Cell& cell, JsonReading& reading) {
  for (std::size_t i = 0; i < cell.jobs.size(); ++i) {
    if (!cell.jobs[i].gaps) continue;
    const GapTask& task = *cell.jobs[i].gaps;
    for (std::size_t k = 0; k < task.gaps.size(); ++k) {
      const GapView& gap = task.gaps[k];
      const CalibratedCamera& camera = cell.calibration.at(gap.camera);
      const auto pixels =
          static_cast<std::size_t>(camera.model.width_px) * static_cast<std::size_t>(camera.model.height_px);
      const std::vector<std::uint8_t> empty(pixels);
      const ImageView image{empty.data(), camera.model.width_px, camera.model.height_px,
                            camera.model.width_px};
      const GapResult result = measure_gap({camera, gap.plane, gap.search, image});
      if (result.status == GapStatus::wrong_problem || result.status == GapStatus::outside_image)
        reading.add_mistake(path_of(path_of("jobs", i) + ".gaps.places", k),
                            concat({"a gap that cannot be measured: ", result.reason}),
                            "a window, limits and a plane that the calibrated camera can see");
    }
  }
}

}  // namespace zeropose
