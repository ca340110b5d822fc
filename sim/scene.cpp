#include "sim/scene.h"

#include <algorithm>

#include "config/config_error.h"
#include "sim/sim_file.h"

namespace zeropose {
namespace {

std::string size_text(int width, int height) {
  return std::to_string(width) + " x " + std::to_string(height);
}

// The true cameras in the cell's order; adds what does not fit to the mistakes.
std::vector<CalibratedCamera> in_order(const std::vector<CameraOptions>& wanted,
                                       const std::vector<CalibratedCamera>& known, const std::string& file,
                                       std::vector<std::string>& mistakes) {
  std::vector<CalibratedCamera> ordered;
  for (const CameraOptions& camera : wanted) {
    const auto truth = std::ranges::find(known, camera.name, &CalibratedCamera::name);
    const std::string key = file + ": cameras." + camera.name + ": ";
    if (truth == known.end()) {
      mistakes.push_back(key + "missing, expected the true camera of that name in the cell file");
      continue;
    }
    if (truth->model.width_px != camera.width_px || truth->model.height_px != camera.height_px)
      mistakes.push_back(key + "found " + size_text(truth->model.width_px, truth->model.height_px) +
                         " px, expected " + size_text(camera.width_px, camera.height_px) +
                         " px as in the cell file");
    ordered.push_back(*truth);
  }
  for (const CalibratedCamera& camera : known)
    if (std::ranges::find(wanted, camera.name, &CameraOptions::name) == wanted.end())
      mistakes.push_back(file + ": cameras." + camera.name +
                         ": unknown, expected only cameras of the cell file");
  return ordered;
}

// A mark may be seen from several positions of one camera.
void add_view(std::vector<View>& views, const View& view) {
  const bool known = std::ranges::any_of(
      views, [&](const View& other) { return other.camera == view.camera && other.mark == view.mark; });
  if (!known) views.push_back(view);
}

void put_on_hands(const Cell& cell, const Job& job, Scene& scene) {
  for (std::size_t i = 0; i < scene.cameras.size(); ++i) {
    if (!cell.hand_of[i]) continue;
    const std::size_t robot = *cell.hand_of[i];
    scene.hand_cameras.push_back({i, robot, cell.robots[robot].X_WR, scene.cameras[i].X_WC});
    const auto position = std::ranges::find_if(job.positions, [&](const HandPosition& p) {
      return std::ranges::find(p.cameras, i) != p.cameras.end();
    });
    const auto* gaps = std::get_if<GapsObject>(&scene.object);
    const Pose X_RH = position != job.positions.end() ? position->X_RH
                      : gaps != nullptr               ? gaps->X_RH
                                                      : Pose::Identity();
    scene.cameras[i] = virtual_camera(scene.cameras[i], cell.robots[robot].X_WR * X_RH);
  }
}

Scene scene_of(const Cell& cell, const Job& job, const std::vector<CalibratedCamera>& cameras,
               const SimFile& truth) {
  Scene scene;
  scene.cameras = cameras;
  scene.marks = job.marks;
  scene.object = truth.object;
  if (auto* gaps = std::get_if<GapsObject>(&scene.object)) complete(*gaps, cell, job, scene.cameras);
  if (auto* wheel = std::get_if<WheelObject>(&scene.object)) complete(*wheel, job, scene.cameras);
  put_on_hands(cell, job, scene);
  for (const View& view : job.views)
    add_view(scene.views, {device_of(job, view.camera, cell.cameras.size()), view.mark});
  for (const ReferencePoint& point : cell.references.points) scene.fixed_marks.push_back(point.mark);
  scene.fixed_views = cell.references.views;
  const auto* gaps = std::get_if<GapsObject>(&scene.object);
  scene.X_WO_nominal = gaps != nullptr ? gaps->X_WR * gaps->X_RH * gaps->X_HT : job.X_WO_nominal;
  scene.picture = truth.picture;
  return scene;
}

}  // namespace

std::vector<Mark> marks_seen(const std::vector<Mark>& marks, const std::vector<View>& views,
                             std::size_t camera) {
  std::vector<Mark> seen;
  for (const View& view : views)
    if (view.camera == camera) seen.push_back(marks.at(view.mark));
  return seen;
}

std::vector<Scene> load_scenes(const Cell& cell, const std::filesystem::path& sim_file) {
  const SimFile truth = load_sim_file(sim_file);
  std::vector<std::string> mistakes;
  const auto cameras = in_order(cell.cameras, truth.cameras, sim_file.string(), mistakes);
  if (cell.jobs.empty()) mistakes.push_back("the cell has no job, expected one whose marks can be rendered");
  for (const Job& job : cell.jobs) {
    if (job.gaps && !std::holds_alternative<GapsObject>(truth.object))
      mistakes.push_back(sim_file.string() + ": object: job " + job.name +
                         " has gaps, expected an object of kind gaps");
    if (job.wheel && !std::holds_alternative<WheelObject>(truth.object))
      mistakes.push_back(sim_file.string() + ": object: job " + job.name +
                         " has a wheel, expected an object of kind wheel");
  }
  if (!mistakes.empty()) throw ConfigError(mistakes);
  std::vector<Scene> scenes;
  for (const Job& job : cell.jobs) scenes.push_back(scene_of(cell, job, cameras, truth));
  return scenes;
}

Scene load_scene(const Cell& cell, const std::filesystem::path& sim_file) {
  return load_scenes(cell, sim_file).front();
}

}  // namespace zeropose
