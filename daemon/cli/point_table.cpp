#include "daemon/cli/point_table.h"

#include <iomanip>
#include <sstream>

namespace zeropose::cli {
namespace {

// In quotes where the reader would take it for something else.
std::string cell_of(const std::string& text) {
  if (text.find_first_of(",\"") == std::string::npos && text.find('#') != 0) return text;
  std::string cell = "\"";
  for (const char letter : text) cell += letter == '"' ? std::string("\"\"") : std::string(1, letter);
  return cell + '"';
}

}  // namespace

std::string point_table(std::span<const TablePoint> points, bool roles) {
  std::ostringstream text;
  text << (roles ? "point,role,x_mm,y_mm,z_mm\n" : "point,x_mm,y_mm,z_mm\n") << std::setprecision(12);
  for (const TablePoint& point : points)
    text << cell_of(point.name) << (roles ? "," + point.role : "") << ',' << point.p_mm.x() << ','
         << point.p_mm.y() << ',' << point.p_mm.z() << '\n';
  return text.str();
}

}  // namespace zeropose::cli
