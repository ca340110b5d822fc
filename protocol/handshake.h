// The handshake with one robot (spec 80): which command counts, what is published, and for how long. Pure:
// the time is an argument, so tests never sleep.
//
// A finished Measure shows its request id with "result valid" or "not ok" and a code. A finished Zero,
// SelectJob, Reset, Halt or Resume shows its request id with code 0, not busy, and neither bit: it carries no
// correction. A withdrawn answer shows request id 0.
#pragma once

#include <deque>
#include <optional>

#include "protocol/codec.h"

namespace zeropose {

struct HandshakeOptions {
  std::size_t robot = 0;          // index in the config, comes back in every Request
  std::uint16_t robot_index = 1;  // on the wire
  Convention convention = Convention::generic;
  std::uint16_t frame = 1;                   // number of spec 80, not interpreted here
  std::uint32_t epoch = 1;                   // of the first session; different after every start, not 0
  std::chrono::milliseconds validity{2000};  // 1..65535
  std::chrono::milliseconds measure_deadline{500};
  std::chrono::milliseconds zero_deadline{10000};  // of Zero and AtPosition
};

using ConnectionId = std::uint64_t;

enum class CommandVerdict {
  busy,               // exception 06
  wrong_request_id,   // 0, the last one again, or one whose late answer is still to come: exception 03
  wrong_acknowledge,  // not the last id, or not the connection that sent it: exception 03
  wrong_argument,     // Acknowledge or Heartbeat with an argument, a position that is none: exception 03
  accepted
};

struct CommandOutcome {
  CommandVerdict verdict = CommandVerdict::wrong_request_id;
  // What the cycle has to do. Measure, Zero and SelectJob want a report; Reset only says: validate again.
  std::optional<Request> request;
};

struct HandshakeCounters {
  std::uint64_t accepted = 0, refused_busy = 0, refused_request_id = 0, refused_acknowledge = 0,
                refused_argument = 0, heartbeats = 0, timeouts = 0, late_reports = 0, orphaned_reports = 0,
                valid_results = 0, not_ok_results = 0, expired = 0;
};

class Handshake {
 public:
  // Throws std::invalid_argument when an option is out of range or the convention is never on the wire.
  explicit Handshake(const HandshakeOptions& options);

  // Withdraws a valid result when the cell is no longer ready or not the one that was measured with.
  void set_cell_state(const CellState& cell, TimePoint now);
  CommandOutcome on_command(const Command& command, ConnectionId from, TimePoint now);
  // Kept for the AtPosition of the same connection that names its index; each counts once.
  CommandVerdict on_position(const PositionBlock& position, ConnectionId from, TimePoint now);
  void on_exposure_done(std::uint32_t request_id, TimePoint now);
  void on_report(const Report& report, TimePoint now);
  void on_disconnect(ConnectionId connection, TimePoint now);

  // Publishes the time-out at the deadline and withdraws a result at the end of its validity.
  void tick(TimePoint now);
  // When tick() has something to do.
  std::optional<TimePoint> next_event() const;

  // What a robot that reads now gets, with its age.
  ResultBlock block(TimePoint now);

  std::optional<ConnectionId> owner() const { return owner_; }
  const HandshakeCounters& counters() const { return counters_; }

 private:
  struct Execution {
    Request request;
    CellState cell;  // when the command was accepted
    bool exposure_done = false;
    bool orphaned = false;  // its owner is gone: the answer will not be published
  };
  // A request that timed out and whose report is still to come: its id is not taken again before that.
  struct Abandoned {
    std::uint32_t id;
    TimePoint until;
  };
  struct Position {
    std::uint32_t index;
    Pose X_RH;
    ConnectionId from;
  };
  struct Answer {
    std::uint32_t id = 0;
    std::uint16_t job = 0;
    std::uint32_t part = 0;
    bool exposure_done = false;
    TimePoint published;
    ResultBlock fields;  // only those of put_report()
    bool valid() const { return fields.has(status_bit::result_valid); }
  };

  CommandOutcome acknowledge(const Command& command, ConnectionId from);
  CommandOutcome take(const Command& command, ConnectionId from, TimePoint now);
  CommandOutcome at_position(const Command& command, ConnectionId from, TimePoint now);
  Code why_not(const Command& command) const;
  CommandOutcome start(const Command& command, TimePoint now);
  CommandOutcome answer_at_once(const Command& command, Code code, TimePoint now);
  Request request_of(const Command& command, TimePoint now);
  CommandVerdict refuse(CommandVerdict verdict);
  bool is_ready() const;
  Code code_of(const Execution& execution, const Report& report) const;
  void publish(const Execution& execution, const Report& report, TimePoint now);
  void abandon(std::uint32_t request_id, TimePoint now);
  bool is_abandoned(std::uint32_t request_id, TimePoint now);
  LinkState state() const;
  std::uint16_t status() const;
  ResultBlock compose() const;
  void refresh();

  HandshakeOptions options_;
  HandshakeCounters counters_;
  CellState cell_;
  bool halted_ = false, error_ = false;
  std::uint32_t epoch_;
  std::uint64_t tickets_ = 0;
  std::uint32_t last_id_ = 0;
  std::optional<ConnectionId> owner_;
  std::optional<Execution> execution_;
  std::optional<Answer> answer_;
  std::optional<Position> position_;
  std::deque<Abandoned> abandoned_;
  ResultBlock shown_;
};

}  // namespace zeropose
