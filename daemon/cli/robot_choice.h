// Which robot the verbs about robots mean.
#pragma once

#include <string>

#include "config/cell.h"

namespace zeropose::cli {

// The robot of a cell file; without a name the only one. Throws ConfigError of the cell file,
// std::invalid_argument when the cell has no such robot or several and none was named.
RobotOptions robot_of_cell(const std::string& cell, const std::string& name);

}  // namespace zeropose::cli
