// The wires that a cell's robots hang on.
#pragma once

#include <memory>
#include <vector>

#include "config/cell.h"
#include "protocol/robot_endpoint.h"

namespace zeropose {

// One endpoint for each robot, in the same order; they must outlive the wires. Robots of one address and port
// share a server. Throws std::runtime_error that names what cannot be opened.
std::vector<std::unique_ptr<Wire>> open_wires(const std::vector<RobotOptions>& robots,
                                              const std::vector<std::unique_ptr<RobotEndpoint>>& endpoints);

}  // namespace zeropose
