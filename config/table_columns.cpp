#include "config/table_columns.h"

#include <string>

namespace zeropose {

Eigen::Vector2d pixel_of(CsvTable& table, std::size_t row) {
  return {table.number(row, "u_px", -largest_px, largest_px),
          table.number(row, "v_px", -largest_px, largest_px)};
}

Eigen::Matrix2d covariance_of(CsvTable& table, std::size_t row) {
  Eigen::Matrix2d covariance = Eigen::Matrix2d::Identity();
  const bool none = table.is_blank(row, "suu") && table.is_blank(row, "svv") && table.is_blank(row, "suv");
  if (none) return covariance;
  const double suu = table.number(row, "suu", above_zero, largest_px);
  const double svv = table.number(row, "svv", above_zero, largest_px);
  const double suv = table.number(row, "suv", -largest_px, largest_px);
  covariance << suu, suv, suv, svv;
  if (suu > 0 && svv > 0 && suv * suv >= suu * svv)
    table.add_mistake(row, "suv", std::to_string(suv), "suv^2 < suu svv: a covariance");
  return covariance;
}

}  // namespace zeropose
