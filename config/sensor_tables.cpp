#include "config/sensor_tables.h"

#include <algorithm>
#include <set>

#include "config/csv.h"
#include "config/table_columns.h"
#include "config/text.h"

namespace zeropose {
namespace {

// The index of the element of this name; a mistake where there is none.
template <typename List, typename Name>
std::size_t index_of(CsvTable& table, std::size_t row, std::string_view column, const List& list,
                     Name name_of) {
  const std::string name = table.text(row, column);
  const auto found = std::ranges::find(list, name, name_of);
  if (found != list.end()) return static_cast<std::size_t>(found - list.begin());
  if (!name.empty())
    table.add_mistake(row, column, in_quotes(name), concat({"the name of a ", column, " of the other file"}));
  return 0;
}

// point_of(table, row): the index of the row's point.
template <typename PointOf>
std::vector<SensorSighting> read_sightings(const std::filesystem::path& path,
                                           std::span<const CalibratedCamera> cameras, const NamedPoses* hand,
                                           PointOf point_of) {
  CsvColumns columns{{"camera", "point", "u_px", "v_px"}, {"suu", "svv", "suv"}};
  if (hand) columns.required.push_back("view");
  CsvTable table = load_csv(path, columns);
  std::vector<SensorSighting> sightings;
  for (std::size_t row = 0; row < table.rows(); ++row) {
    SensorSighting sighting;
    sighting.point = point_of(table, row);
    if (hand) {
      const std::size_t view = index_of(table, row, "view", *hand, &std::pair<std::string, Pose>::first);
      sighting.view = table.text(row, "view");
      if (view < hand->size()) sighting.X_RH = (*hand)[view].second;
    }
    Observation observation;
    observation.camera = index_of(table, row, "camera", cameras, &CalibratedCamera::name);
    observation.u_px = pixel_of(table, row);
    observation.covariance_px2 = covariance_of(table, row);
    auto known = std::ranges::find_if(sightings, [&](const SensorSighting& other) {
      return other.point == sighting.point && other.view == sighting.view;
    });
    if (known == sightings.end()) known = sightings.insert(known, sighting);
    if (std::ranges::find(known->observations, observation.camera, &Observation::camera) !=
        known->observations.end())
      table.add_mistake(row, "point", in_quotes(table.text(row, "point")) + " again in this camera",
                        hand ? "each point once per camera and view" : "each point once per camera");
    known->observations.push_back(observation);
  }
  table.throw_if_wrong();
  return sightings;
}

}  // namespace

std::vector<KnownPoint> load_known_points(const std::filesystem::path& path, double sigma_mm) {
  CsvTable table = load_csv(path, {{"point", "x_mm", "y_mm", "z_mm"}, {"sigma_mm"}});
  std::vector<KnownPoint> points;
  std::set<std::string> names;
  for (std::size_t row = 0; row < table.rows(); ++row) {
    KnownPoint point;
    point.name = table.text(row, "point");
    point.p_mm = {table.number(row, "x_mm", -largest_mm, largest_mm),
                  table.number(row, "y_mm", -largest_mm, largest_mm),
                  table.number(row, "z_mm", -largest_mm, largest_mm)};
    point.sigma_mm = table.number_or(row, "sigma_mm", sigma_mm, above_zero, any_number);
    if (!point.name.empty() && !names.insert(point.name).second)
      table.add_mistake(row, "point", in_quotes(point.name) + " again", "each point once");
    points.push_back(std::move(point));
  }
  table.throw_if_wrong();
  return points;
}

std::vector<SensorSighting> load_sightings(const std::filesystem::path& path,
                                           std::span<const CalibratedCamera> cameras,
                                           std::span<const KnownPoint> points,
                                           const std::optional<NamedPoses>& hand) {
  return read_sightings(path, cameras, hand ? &*hand : nullptr, [&](CsvTable& table, std::size_t row) {
    return index_of(table, row, "point", points, &KnownPoint::name);
  });
}

NamedSightings load_sightings(const std::filesystem::path& path, std::span<const CalibratedCamera> cameras,
                              const NamedPoses& hand) {
  NamedSightings named;
  named.sightings = read_sightings(path, cameras, &hand, [&](CsvTable& table, std::size_t row) {
    const std::string name = table.text(row, "point");
    const auto known = std::ranges::find(named.points, name);
    if (known != named.points.end()) return static_cast<std::size_t>(known - named.points.begin());
    named.points.push_back(name);
    return named.points.size() - 1;
  });
  return named;
}

}  // namespace zeropose
