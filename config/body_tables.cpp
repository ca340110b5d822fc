#include "config/body_tables.h"

#include <set>

#include "config/csv.h"
#include "config/table_columns.h"
#include "config/text.h"

namespace zeropose {
namespace {

Eigen::Vector3d vector_of(CsvTable& table, std::size_t row, const char* x, const char* y, const char* z) {
  return {table.number(row, x, -largest_mm, largest_mm), table.number(row, y, -largest_mm, largest_mm),
          table.number(row, z, -largest_mm, largest_mm)};
}

}  // namespace

std::vector<BodyMark> load_body(const std::filesystem::path& path) {
  CsvTable table = load_csv(path, {{"mark", "x_mm", "y_mm", "z_mm"}, {"radius_mm", "nx", "ny", "nz"}});
  std::vector<BodyMark> marks;
  std::set<std::string> names;
  for (std::size_t row = 0; row < table.rows(); ++row) {
    BodyMark mark;
    mark.name = table.text(row, "mark");
    mark.p_B_mm = vector_of(table, row, "x_mm", "y_mm", "z_mm");
    mark.radius_mm = table.number_or(row, "radius_mm", 0, 0, largest_mm);
    if (!table.is_blank(row, "nx") || !table.is_blank(row, "ny") || !table.is_blank(row, "nz")) {
      mark.normal_B = vector_of(table, row, "nx", "ny", "nz");
      if (mark.normal_B.isZero()) table.add_mistake(row, "nx", "the normal 0 0 0", "a direction");
    }
    if (!mark.name.empty() && !names.insert(mark.name).second)
      table.add_mistake(row, "mark", in_quotes(mark.name) + " again", "each mark once");
    marks.push_back(std::move(mark));
  }
  table.throw_if_wrong();
  return marks;
}

std::vector<ControlMark> load_control_marks(const std::filesystem::path& path) {
  CsvTable table = load_csv(path, {{"xa", "ya", "za", "xb", "yb", "zb"}, {"mark", "weight"}});
  std::vector<ControlMark> marks;
  for (std::size_t row = 0; row < table.rows(); ++row) {
    ControlMark mark;
    mark.name = table.has("mark") ? table.text(row, "mark") : std::to_string(row + 1);
    mark.pair.p_A_mm = vector_of(table, row, "xa", "ya", "za");
    mark.pair.p_B_mm = vector_of(table, row, "xb", "yb", "zb");
    mark.pair.weight = table.number_or(row, "weight", 1, above_zero, any_number);
    marks.push_back(std::move(mark));
  }
  table.throw_if_wrong();
  return marks;
}

}  // namespace zeropose
