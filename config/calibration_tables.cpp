#include "config/calibration_tables.h"

#include <algorithm>

#include "config/csv.h"
#include "config/table_columns.h"
#include "config/text.h"

namespace zeropose {
namespace {

CsvColumns columns_and(std::vector<std::string_view> required, std::vector<std::string_view> optional) {
  CsvColumns columns{
      {"x_mm", "y_mm", "u_px", "v_px"},
      {"z_mm", "suu", "svv", "suv", "radius_mm", "nx", "ny", "nz", "id", "row", "col", "mark"}};
  columns.required.insert(columns.required.end(), required.begin(), required.end());
  columns.optional.insert(columns.optional.end(), optional.begin(), optional.end());
  return columns;
}

bool has_normal(const CsvTable& table, std::size_t row) {
  return !table.is_blank(row, "nx") || !table.is_blank(row, "ny") || !table.is_blank(row, "nz");
}

Eigen::Vector3d normal_of(CsvTable& table, std::size_t row) {
  const Eigen::Vector3d normal(table.number(row, "nx", -largest_mm, largest_mm),
                               table.number(row, "ny", -largest_mm, largest_mm),
                               table.number(row, "nz", -largest_mm, largest_mm));
  if (normal.isZero()) table.add_mistake(row, "nx", "the normal 0 0 0", "a direction");
  return normal;
}

CalibrationPoint point_of(CsvTable& table, std::size_t row) {
  CalibrationPoint point;
  point.p_W_mm.x() = table.number(row, "x_mm", -largest_mm, largest_mm);
  point.p_W_mm.y() = table.number(row, "y_mm", -largest_mm, largest_mm);
  // A cell left blank is a mistake, a column left out says that the points are a board's.
  if (table.has("z_mm")) point.p_W_mm.z() = table.number(row, "z_mm", -largest_mm, largest_mm);
  point.u_px = pixel_of(table, row);
  point.covariance_px2 = covariance_of(table, row);
  point.disc_radius_mm = table.number_or(row, "radius_mm", 0, 0, largest_mm);
  if (has_normal(table, row)) point.disc_normal_W = normal_of(table, row);
  return point;
}

// Where the name stands in the list; a new one is appended. Tables have few cameras and views.
std::size_t index_in(std::vector<std::string>& names, const std::string& name) {
  const auto found = std::ranges::find(names, name);
  if (found != names.end()) return static_cast<std::size_t>(found - names.begin());
  names.push_back(name);
  return names.size() - 1;
}

}  // namespace

std::vector<CalibrationPoint> load_calibration_points(const std::filesystem::path& path) {
  CsvTable table = load_csv(path, columns_and({}, {}));
  std::vector<CalibrationPoint> points;
  for (std::size_t row = 0; row < table.rows(); ++row) {
    points.push_back(point_of(table, row));
    if (points.back().disc_radius_mm > 0 && !has_normal(table, row))
      table.add_mistake(row, "radius_mm", "a disc without nx ny nz", "the normal of its plane");
  }
  table.throw_if_wrong();
  return points;
}

CalibrationViews load_calibration_views(const std::filesystem::path& path) {
  CsvTable table = load_csv(path, columns_and({"view"}, {"camera"}));
  CalibrationViews views;
  for (std::size_t row = 0; row < table.rows(); ++row) {
    ViewPoint seen;
    seen.view = index_in(views.views, table.text(row, "view"));
    seen.camera = index_in(views.cameras, table.has("camera") ? table.text(row, "camera") : "camera");
    seen.point = point_of(table, row);
    if (!has_normal(table, row)) seen.point.disc_normal_W = Eigen::Vector3d::UnitZ();
    views.points.push_back(seen);
  }
  table.throw_if_wrong();
  return views;
}

}  // namespace zeropose
