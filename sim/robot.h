// The robot program's side of the interface, with every check that a robot has to make before it moves (spec
// 80).
#pragma once

#include <chrono>
#include <optional>
#include <span>
#include <string>

#include "protocol/codec.h"
#include "protocol/line_socket.h"

namespace zeropose {

struct SimulatedRobotOptions {
  std::string address = "127.0.0.1";  // numeric IPv4
  std::uint16_t port = 1502;
  std::uint8_t unit = 1;
  Convention convention = Convention::generic;
  std::uint16_t frame = 1;
  std::uint16_t robot_index = 1;
  std::uint16_t result_data_id = default_result_data_id;
  std::uint16_t command_data_id = default_command_data_id;
  std::uint32_t first_request_id = 1;
  double max_translation_mm =
      100;  // the robot's own limits, of the length and of the angle of the correction
  double max_rotation_deg = 10;
  std::chrono::milliseconds patience{2000};        // from Measure to its answer
  std::chrono::milliseconds zero_patience{20000};  // from Zero to its answer
  std::chrono::milliseconds reply_time{1000};      // from a Modbus request to its reply
  std::chrono::milliseconds poll_period{2};
};

// What the robot knows when it looks at a block that should answer its request.
struct RobotExpectation {
  std::uint32_t request_id = 0, epoch = 0, part = 0;
  std::uint16_t job = 0;
  std::uint32_t last_used_id = 0;           // the result that was used last: never again
  std::chrono::milliseconds since_read{0};  // by the robot's clock, since it asked for the block
  std::chrono::milliseconds since_command{0};
};

// A refusal is a named reason not to move. Only an empty one comes with a correction.
struct CheckedBlock {
  std::string refusal = "not checked";
  std::optional<Pose> correction;
  ResultBlock block;
};
CheckedBlock check_result(std::span<const std::uint16_t> registers, const RobotExpectation& expected,
                          const SimulatedRobotOptions& options);

// The robot's own limits, of the length and of the angle; empty: within them.
std::string refusal_by_limits(const Pose& correction, double max_translation_mm, double max_rotation_deg);

struct RobotAnswer {
  std::string refusal = "not asked";  // empty: accepted (Measure: with a correction), or done
  std::optional<Pose> correction;
  std::uint32_t request_id = 0;
  std::uint16_t code = 0;                                     // of the block, when it answered not ok
  std::uint8_t exception = 0;                                 // of Modbus, when the command was refused
  std::optional<std::chrono::microseconds> to_exposure_done;  // from sending the command, as seen by polling
  std::chrono::microseconds to_answer{0};
  ResultBlock block;  // the last one read
  bool ok() const { return refusal.empty(); }
};

// Where the daemon wants the hand.
struct HandTarget {
  std::uint32_t index = 0;  // from 1
  Pose X_RH = Pose::Identity();
};

// Connects when needed. Not thread-safe. Nothing here throws for what a cell or a network can do.
class SimulatedRobot {
 public:
  explicit SimulatedRobot(const SimulatedRobotOptions& options);

  RobotAnswer measure(std::uint16_t job, std::uint32_t part, std::int32_t axis_position_um = 0);
  RobotAnswer zero(std::uint16_t job);
  // Tells where the hand is; position counts from 1.
  RobotAnswer at_position(std::uint16_t job, std::uint32_t part, std::int32_t position, const Pose& X_RH);
  // Where the daemon wants the hand next, of this session; nullopt: nowhere.
  std::optional<HandTarget> target();
  RobotAnswer select_job(std::uint16_t job);
  RobotAnswer reset();
  RobotAnswer halt();
  RobotAnswer resume();
  RobotAnswer acknowledge();  // of the last request; refused when the result is still there afterwards
  RobotAnswer heartbeat();
  RobotAnswer read();  // just looks at the block
  void disconnect();
  std::uint32_t next_request_id() const { return next_id_; }

 private:
  using Clock = std::chrono::steady_clock;
  struct Reply {
    std::string failure;  // empty: pdu is a normal answer
    std::uint8_t exception = 0;
    std::vector<std::uint8_t> pdu;
  };

  RobotAnswer command(CommandKind kind, std::uint16_t job, std::uint32_t part, std::int32_t argument,
                      std::chrono::milliseconds patience);
  RobotAnswer wait_for_answer(CommandKind kind, RobotExpectation expected,
                              std::chrono::milliseconds patience);
  void judge(CommandKind kind, RobotExpectation expected, std::span<const std::uint16_t> registers,
             Clock::time_point read_started, RobotAnswer& answer);
  RobotAnswer send(const Command& command);
  RobotAnswer write(std::uint16_t first, std::span<const std::uint16_t> registers);
  // `count` input registers from `first` on, not looked at.
  bool read_registers(std::size_t first, std::size_t count, std::vector<std::uint16_t>& registers,
                      RobotAnswer& answer);
  bool read_block(std::vector<std::uint16_t>& registers, RobotAnswer& answer);
  std::string connect();
  Reply exchange(std::span<const std::uint8_t> pdu);
  std::string receive(std::span<std::uint8_t> bytes, Clock::time_point until);

  SimulatedRobotOptions options_;
  Descriptor socket_;
  std::uint16_t transaction_ = 0;
  std::uint32_t next_id_, last_id_ = 0, last_used_id_ = 0;
  Clock::time_point commanded_;
};

}  // namespace zeropose
