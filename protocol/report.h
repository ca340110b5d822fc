// What passes between the cycle and a robot link, before anything is a register or a CAN frame.
#pragma once

#include <chrono>
#include <cstdint>

#include "calib/rigid.h"
#include "measure/code.h"

namespace zeropose {

using TimePoint = std::chrono::steady_clock::time_point;

// Numbers as on the wire (spec 80).
enum class CommandKind : std::uint16_t {
  measure = 1,
  acknowledge,
  zero,
  select_job,
  reset,
  heartbeat,
  at_position,
  halt,
  resume
};

// A command that the handshake accepted and that the cycle has to carry out.
struct Request {
  std::size_t robot = 0;  // index in the config
  CommandKind kind = CommandKind::measure;
  std::uint32_t id = 0;
  std::uint16_t job = 0;
  std::uint32_t part = 0;
  std::int32_t argument = 0;
  TimePoint received;
  TimePoint deadline;  // the answer is published then at the latest, whatever it is
  // Counts the requests of one link: a robot may use an id again, a ticket never comes back.
  std::uint64_t ticket = 0;
  Pose X_RH = Pose::Identity();  // of AtPosition only: where the robot's hand is
};

// The cycle's answer to one request. Only code ok publishes values.
struct Report {
  std::uint32_t request_id = 0;
  Code code = Code::internal;
  Pose correction = Pose::Identity();  // in the frame that the robot is configured for
  int effective_marks = 0, effective_cameras = 0;
  double largest_deviation_mm = 0;
  double sigma_mm = 0;
  std::uint64_t ticket = 0;  // of the request; 0: not told, then the id alone decides
};

// What decides whether a robot may measure, kept current by the daemon.
struct CellState {
  bool config_valid = false;
  bool cameras_alive = false;  // all of the selected job
  bool zero_valid = false;     // of the selected job, for this calibration
  bool simulated = false;
  std::uint32_t config_hash = 0, calibration_hash = 0, zero_id = 0;
  bool camera_moved = false;  // when its references were last looked at; a new Measure looks again
};

}  // namespace zeropose
