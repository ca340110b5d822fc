// Corrections out: the interfaces between the cycle and the daemon's main loop here, Modbus and CAN there.
#pragma once

#include <functional>
#include <string>

#include "protocol/report.h"

namespace zeropose {

// The handshake with one robot. Thread-safe.
class RobotLink {
 public:
  virtual ~RobotLink() = default;
  virtual void set_cell_state(const CellState& state) = 0;
  virtual void exposure_done(std::uint32_t request_id) = 0;
  // The answer to the request under way. Too late, or of another id: ignored and counted.
  virtual void publish(const Report& report) = 0;
  // Where its hand shall go next, X_RH; index 0: nowhere. Only Modbus servers carry it.
  virtual void show_target(std::uint32_t index, const Pose& X_RH) = 0;
};

// Called from the link's thread for every accepted command that the cycle has to carry out. Must not block.
using RequestHandler = std::function<void(const Request&)>;

// What robots hang on: a server or a client of Modbus, a CAN node. Owns its own thread.
class Wire {
 public:
  virtual ~Wire() = default;
  // Of the thread's loop: grows at least twice a second while it is alive.
  virtual std::uint64_t rounds() const = 0;
  // Why nobody can be reached on it at the moment, and what to do; empty: it is ready.
  virtual std::string problem() const = 0;
};

}  // namespace zeropose
