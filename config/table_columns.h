// Columns that several tables share.
#pragma once

#include <Eigen/Core>
#include <limits>

#include "config/csv.h"

namespace zeropose {

inline constexpr double any_number = std::numeric_limits<double>::max();
inline constexpr double above_zero = std::numeric_limits<double>::min();
inline constexpr double largest_mm = 1e6;
inline constexpr double largest_px = 1e6;

// Columns u_px v_px.
Eigen::Vector2d pixel_of(CsvTable& table, std::size_t row);

// Columns suu svv suv, px^2, all or none: without them the identity, one pixel.
Eigen::Matrix2d covariance_of(CsvTable& table, std::size_t row);

}  // namespace zeropose
