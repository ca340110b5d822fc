// Corrections out: the one interface behind which Modbus and CAN stand.
#pragma once

#include <functional>

#include "protocol/report.h"

namespace zeropose {

// Owns its own thread and the handshake with one robot. Thread-safe.
class RobotLink {
 public:
  virtual ~RobotLink() = default;
  virtual void set_cell_state(const CellState& state) = 0;
  virtual void exposure_done(std::uint32_t request_id) = 0;
  // The answer to the request under way. Too late, or of another id: ignored and counted.
  virtual void publish(const Report& report) = 0;
};

// Called from the link's thread for every accepted command that the cycle has to carry out. Must not block.
using RequestHandler = std::function<void(const Request&)>;

}  // namespace zeropose
