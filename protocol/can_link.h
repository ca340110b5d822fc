// One robot on a CAN bus, through the kernel's SocketCAN (spec 80, CAN).
#pragma once

#include <memory>
#include <string>

#include "protocol/can_node.h"
#include "protocol/robot_endpoint.h"

namespace zeropose {

// Owns its own thread. An interface that is missing or down is no error: it is looked for again all the time,
// with a growing pause of up to two seconds, and the robot's connection begins when it is there. After
// bus-off the interface comes back by itself only with "ip link set can0 type can restart-ms 100".
class CanLink : public Wire {
 public:
  // The endpoint must outlive the link, and has no other wire. Throws std::invalid_argument for an option out
  // of range and for a convention that does not fit; says which and what to do.
  CanLink(const CanOptions& options, RobotEndpoint& endpoint);
  ~CanLink() override;
  CanLink(const CanLink&) = delete;
  CanLink& operator=(const CanLink&) = delete;

  CanCounters counters() const;
  std::uint64_t rounds() const override;  // grows at least twice a second while the link is alive
  CanFault fault() const;
  // Why there is no bus, and what to do; empty: there is one.
  std::string problem() const override;

 private:
  class Loop;
  std::unique_ptr<Loop> loop_;
};

}  // namespace zeropose
