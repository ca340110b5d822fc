// The robot program's side of a CAN link, with the checks of docs/can.md.
#pragma once

#include <optional>

#include "protocol/can_collector.h"
#include "protocol/can_node.h"
#include "protocol/can_socket.h"
#include "sim/robot.h"

namespace zeropose {

struct SimulatedCanRobotOptions {
  CanOptions can;  // as in the cell file, without CAN FD
  Convention convention = Convention::generic;
  double max_translation_mm = 100, max_rotation_deg = 10;  // the robot's own limits
  std::chrono::milliseconds patience{2000};                // from Measure to its answer
  std::uint16_t first_request_id = 1;
};

// Not thread-safe.
class SimulatedCanRobot {
 public:
  // Throws std::runtime_error, with what to do, where there is no such bus.
  explicit SimulatedCanRobot(const SimulatedCanRobotOptions& options);

  // The code of RobotAnswer is filled in, its block is not.
  RobotAnswer measure(std::uint8_t job, std::uint32_t part);
  void acknowledge();  // of the last request

 private:
  using Clock = std::chrono::steady_clock;

  // nullopt: no answer within a second, or an abort.
  std::optional<std::uint32_t> read(std::uint16_t index, std::uint8_t sub);
  void send(const Command& command);
  // The next frame; nullopt: none until then.
  std::optional<CanFrame> receive(Clock::time_point until);
  RobotAnswer judged(const CanResult& result, std::chrono::milliseconds validity) const;

  const SimulatedCanRobotOptions options_;
  const CanCoding coding_;
  CanSocket socket_;
  CanResultCollector collector_;
  std::uint16_t next_id_, last_id_ = 0;
  Clock::time_point commanded_;
};

}  // namespace zeropose
