#include "config/pose_table.h"

#include <algorithm>

#include "config/csv.h"
#include "config/table_columns.h"
#include "config/text.h"

namespace zeropose {
namespace {

constexpr double largest_deg = 3600;

Pose pose_of(CsvTable& table, std::size_t row) {
  SixNumbers six;
  six.x_mm = table.number(row, "x_mm", -largest_mm, largest_mm);
  six.y_mm = table.number(row, "y_mm", -largest_mm, largest_mm);
  six.z_mm = table.number(row, "z_mm", -largest_mm, largest_mm);
  six.rx_deg = table.number(row, "rx_deg", -largest_deg, largest_deg);
  six.ry_deg = table.number(row, "ry_deg", -largest_deg, largest_deg);
  six.rz_deg = table.number(row, "rz_deg", -largest_deg, largest_deg);
  return from_six_numbers(six);
}

}  // namespace

NamedPoses load_named_poses(const std::filesystem::path& path, std::string_view column, bool required) {
  CsvColumns columns{{"x_mm", "y_mm", "z_mm", "rx_deg", "ry_deg", "rz_deg"}, {}};
  (required ? columns.required : columns.optional).push_back(column);
  CsvTable table = load_csv(path, columns);
  NamedPoses poses;
  for (std::size_t row = 0; row < table.rows(); ++row) {
    const std::string name = table.has(column) ? table.text(row, column) : std::to_string(row + 1);
    if (!name.empty() && std::ranges::find(poses, name, &NamedPoses::value_type::first) != poses.end())
      table.add_mistake(row, column, in_quotes(name) + " again", concat({"each ", column, " once"}));
    poses.emplace_back(name, pose_of(table, row));
  }
  table.throw_if_wrong();
  return poses;
}

}  // namespace zeropose
