#include "config/robot_tables.h"

#include <algorithm>
#include <set>

#include "config/calibration_tables.h"
#include "config/csv.h"
#include "config/pose_table.h"
#include "config/table_columns.h"
#include "config/text.h"

namespace zeropose {

std::vector<HandPose> load_hand_poses(const std::filesystem::path& path, std::string_view column,
                                      bool required) {
  std::vector<HandPose> poses;
  for (const auto& [name, X_RH] : load_named_poses(path, column, required)) poses.push_back({name, X_RH});
  return poses;
}

std::vector<HandEyeView> load_hand_eye_views(const std::filesystem::path& robot,
                                             const std::filesystem::path& points) {
  std::vector<HandEyeView> views;
  for (const HandPose& pose : load_hand_poses(robot, "view", true))
    views.push_back({pose.name, pose.X_RH, {}});
  const CalibrationViews seen = load_calibration_views(points);
  if (seen.cameras.size() > 1)
    throw ConfigError({concat({points.string(), ": found ", std::to_string(seen.cameras.size()),
                               " cameras, expected one: calibrate each by itself"})});
  std::vector<std::string> mistakes;
  std::vector<HandEyeView*> places;
  for (const std::string& name : seen.views) {
    const auto found = std::ranges::find(views, name, &HandEyeView::name);
    places.push_back(found == views.end() ? nullptr : &*found);
    if (found == views.end())
      mistakes.push_back(concat({points.string(), ": found the view ", in_quotes(name),
                                 ", expected one that ", robot.string(), " has"}));
  }
  if (!mistakes.empty()) throw ConfigError(std::move(mistakes));
  for (const ViewPoint& point : seen.points) places[point.view]->points.push_back(point.point);
  return views;
}

std::vector<ViewPixel> load_view_pixels(const std::filesystem::path& path, std::span<const HandPose> poses) {
  CsvTable table = load_csv(path, {{"view", "u_px", "v_px"}, {"suu", "svv", "suv"}});
  std::vector<ViewPixel> pixels;
  std::set<std::string> names;
  for (std::size_t row = 0; row < table.rows(); ++row) {
    pixels.push_back({table.text(row, "view"), pixel_of(table, row), covariance_of(table, row)});
    if (!pixels.back().view.empty() && !names.insert(pixels.back().view).second)
      table.add_mistake(row, "view", in_quotes(pixels.back().view) + " again", "each view once");
    if (std::ranges::find(poses, pixels.back().view, &HandPose::name) == poses.end())
      table.add_mistake(row, "view", in_quotes(pixels.back().view), "a view that the robot's table has");
  }
  table.throw_if_wrong();
  return pixels;
}

}  // namespace zeropose
