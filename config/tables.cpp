#include "config/tables.h"

#include <algorithm>
#include <map>
#include <set>

#include "config/cameras.h"
#include "config/csv.h"
#include "config/table_columns.h"
#include "config/text.h"

namespace zeropose {
namespace {

Mark mark_of(CsvTable& table, std::size_t row) {
  Mark mark;
  mark.name = table.text(row, "mark");
  mark.p_O_mm = {table.number(row, "x_mm", -largest_mm, largest_mm),
                 table.number(row, "y_mm", -largest_mm, largest_mm),
                 table.number(row, "z_mm", -largest_mm, largest_mm)};
  mark.weight = table.number_or(row, "weight", 1, 0, 1);
  mark.tolerance_px = table.number_or(row, "tolerance_px", no_tolerance, above_zero, any_number);
  mark.tolerance_mm = table.number_or(row, "tolerance_mm", no_tolerance, above_zero, any_number);
  mark.sigma_mm = table.number_or(row, "sigma_mm", 0, 0, any_number);
  return mark;
}

// The index of the element of this name; a mistake when there is none.
template <typename Element>
std::size_t index_of(CsvTable& table, std::size_t row, std::string_view column,
                     std::span<const Element> elements) {
  const std::string name = table.text(row, column);
  const auto found = std::ranges::find(elements, name, &Element::name);
  if (found != elements.end()) return static_cast<std::size_t>(found - elements.begin());
  if (!name.empty())
    table.add_mistake(row, column, in_quotes(name), concat({"the name of a ", column, " of the other file"}));
  return 0;
}

}  // namespace

std::vector<Mark> load_marks(const std::filesystem::path& path) {
  CsvTable table = load_csv(
      path, {{"mark", "x_mm", "y_mm", "z_mm"}, {"weight", "tolerance_px", "tolerance_mm", "sigma_mm"}});
  std::vector<Mark> marks;
  std::set<std::string> names;
  for (std::size_t row = 0; row < table.rows(); ++row) {
    marks.push_back(mark_of(table, row));
    if (!marks.back().name.empty() && !names.insert(marks.back().name).second)
      table.add_mistake(row, "mark", in_quotes(marks.back().name) + " again", "each mark once");
  }
  table.throw_if_wrong();
  return marks;
}

std::vector<Observation> load_observations(const std::filesystem::path& path,
                                           std::span<const CalibratedCamera> cameras,
                                           std::span<const Mark> marks) {
  CsvTable table = load_csv(path, {{"camera", "mark", "u_px", "v_px"}, {"suu", "svv", "suv"}});
  std::vector<Observation> observations;
  std::set<std::pair<std::string, std::string>> seen;
  for (std::size_t row = 0; row < table.rows(); ++row) {
    Observation observation;
    observation.camera = index_of(table, row, "camera", cameras);
    observation.mark = index_of(table, row, "mark", marks);
    observation.u_px = pixel_of(table, row);
    observation.covariance_px2 = covariance_of(table, row);
    const bool named = !table.is_blank(row, "camera") && !table.is_blank(row, "mark");
    if (named && !seen.emplace(table.text(row, "camera"), table.text(row, "mark")).second)
      table.add_mistake(row, "mark", in_quotes(table.text(row, "mark")) + " again in this camera",
                        "each mark once per camera");
    observations.push_back(observation);
  }
  table.throw_if_wrong();
  return observations;
}

PointObservations load_point_observations(const std::filesystem::path& path,
                                          std::span<const CalibratedCamera> cameras) {
  CsvTable table = load_csv(path, {{"camera", "point", "u_px", "v_px"}, {"suu", "svv", "suv"}});
  PointObservations found;
  std::set<std::pair<std::size_t, std::size_t>> seen;
  for (std::size_t row = 0; row < table.rows(); ++row) {
    Observation observation;
    observation.camera = index_of(table, row, "camera", cameras);
    const std::string point = table.text(row, "point");
    const auto known = std::ranges::find(found.points, point);
    observation.mark = static_cast<std::size_t>(known - found.points.begin());
    if (known == found.points.end()) found.points.push_back(point);
    observation.u_px = pixel_of(table, row);
    observation.covariance_px2 = covariance_of(table, row);
    const bool named = !table.is_blank(row, "camera") && !point.empty();
    if (named && !seen.emplace(observation.camera, observation.mark).second)
      table.add_mistake(row, "point", in_quotes(point) + " again in this camera",
                        "each point once per camera");
    found.observations.push_back(observation);
  }
  table.throw_if_wrong();
  return found;
}

std::vector<PointPair> load_point_pairs(const std::filesystem::path& path) {
  CsvTable table = load_csv(path, {{"xa", "ya", "za", "xb", "yb", "zb"}, {"weight"}});
  const auto coordinate = [&](std::size_t row, std::string_view column) {
    return table.number(row, column, -largest_mm, largest_mm);
  };
  std::vector<PointPair> pairs;
  for (std::size_t row = 0; row < table.rows(); ++row) {
    PointPair pair;
    pair.p_A_mm = {coordinate(row, "xa"), coordinate(row, "ya"), coordinate(row, "za")};
    pair.p_B_mm = {coordinate(row, "xb"), coordinate(row, "yb"), coordinate(row, "zb")};
    pair.weight = table.number_or(row, "weight", 1, 0, any_number);
    pairs.push_back(pair);
  }
  table.throw_if_wrong();
  return pairs;
}

PoseInput load_pose_input(const std::filesystem::path& cameras, const std::filesystem::path& marks,
                          const std::filesystem::path& observations) {
  PoseInput input;
  std::vector<std::string> mistakes;
  const auto collect = [&](const auto& read) {
    try {
      read();
    } catch (const ConfigError& error) {
      mistakes.insert(mistakes.end(), error.mistakes().begin(), error.mistakes().end());
    }
  };
  collect([&] { input.cameras = load_cameras(cameras); });
  collect([&] { input.marks = load_marks(marks); });
  // Names are looked up in both: without them every line would be called wrong.
  if (mistakes.empty())
    collect([&] { input.observations = load_observations(observations, input.cameras, input.marks); });
  if (!mistakes.empty()) throw ConfigError(std::move(mistakes));
  return input;
}

}  // namespace zeropose
