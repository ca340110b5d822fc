// A CANopen-shaped node for one robot: what each frame means, and which frames go out (spec 80, CAN). Pure:
// frames and the time in, frames and commands out; the loop around it (CanLink) has the socket and the robot.
//
// One frame is under way at a time: the next one goes out when its echo has come back from the bus. So the
// kernel never holds more than one, and a result that could not be sent is made anew, never sent later.
#pragma once

#include <deque>

#include "protocol/can_dictionary.h"
#include "protocol/handshake.h"

namespace zeropose {

struct CanOptions {
  std::string interface = "can0";  // up to 15 characters
  int node = 1;                    // 1..127
  bool fd = false;                 // results in one frame of 48 bytes instead of three of 8
  double length_scale_um = 10;     // per step of an int16; 1..10000
  // Per step of an int16; 0.0001..1. Kawasaki, Comau, Adept and Doosan need 0.01: their angles are large
  // where the turn is small.
  double angle_scale_deg = 0.001;
  double rotation_vector_scale_rad = 1e-4;   // Universal Robots instead of the angle; 1e-6..1e-3
  std::chrono::milliseconds heartbeat{500};  // 0: none; at most 65535. The robot may change it by SDO
  std::uint16_t result_data_id = default_result_data_id;
  // Results from the start; else only after NMT "start", for a PLC that is the bus's master.
  bool start_at_once = true;
};

// The coding that follows. Throws std::invalid_argument for an option out of range and for a convention that
// has not three lengths and three angles or a rotation vector (ABB).
CanCoding can_coding(const CanOptions& options, Convention convention);

enum class NmtState : std::uint8_t { boot_up = 0, stopped = 4, operational = 5, pre_operational = 127 };

struct CanCounters {
  std::uint64_t frames = 0, commands = 0, nmt = 0, sdo = 0;  // that came in and counted
  std::uint64_t wrong_size = 0, remote = 0, extended = 0, foreign = 0, not_operational = 0;  // ignored
  std::uint64_t refused = 0, sdo_aborts = 0, bus_off = 0, links_lost = 0;
  // Sent: what the bus has echoed. Unconfirmed: what it has not, within the result window.
  std::uint64_t confirmed = 0, results_confirmed = 0, unconfirmed = 0, late_echoes = 0,
                emergencies_dropped = 0;
  std::uint64_t opened = 0;  // times that the interface was found up
  std::uint64_t rounds = 0;  // of the loop: grows at least twice a second while the link is alive
};

// What the loop has to do about a frame.
struct CanTaken {
  std::optional<Command> command;  // take it to the robot, then tell answered()
  bool link_lost = false;          // the owner's connection has ended
};

class CanNode {
 public:
  // Throws as can_coding() does.
  CanNode(const CanOptions& options, Convention convention);

  // own_echo: the kernel says that this frame was sent by us.
  CanTaken take(const CanFrame& frame, bool own_echo, TimePoint now);
  void answered(const Command& command, CommandVerdict verdict);
  // What the robot may see now; goes out when it is another answer than the last.
  void show(const ResultBlock& block);
  void tick(TimePoint now);
  // The interface is there (again), or gone: then nothing that waited is ever sent.
  void link_up(TimePoint now);
  void link_down();

  // The frame to be written now, to be told of failed_to_write() when that did not work.
  std::optional<CanFrame> next_frame(TimePoint now);
  void failed_to_write(TimePoint now);
  // When tick() and next_frame() have something to do.
  std::optional<TimePoint> next_event() const;

  NmtState nmt_state() const { return nmt_; }
  CanFault fault() const { return state_.fault; }
  const CanCounters& counters() const { return counters_; }

 private:
  struct UnderWay {
    CanFrame frame;
    TimePoint written;
  };

  bool is_ours(std::uint32_t id) const;
  bool has_form(const CanFrame& frame, std::size_t size);
  void take_echo(const CanFrame& frame);
  CanTaken take_error(const CanFrame& frame);
  CanTaken take_nmt(const CanFrame& frame, TimePoint now);
  CanTaken take_command(const CanFrame& frame);
  void take_sdo(const CanFrame& frame, TimePoint now);
  void latch(CanFault fault, std::uint16_t emergency);
  void acknowledge_fault();
  bool enter(NmtState state);
  void reset(TimePoint now);

  ResultBlock on_this_wire(ResultBlock block) const;
  void tell_errors(const ResultBlock& before, const ResultBlock& after);
  void update_error_register();
  void make_result();
  void forget_pending();
  void give_up(TimePoint now);
  void add_emergency(std::uint16_t error, std::uint16_t code, std::uint32_t request_id, std::uint8_t detail);
  CanFrame heartbeat_frame(NmtState state) const;
  std::optional<CanFrame> take_pending(TimePoint now);
  bool may_send_pdo() const { return nmt_ == NmtState::operational; }

  const CanOptions options_;
  CanCounters counters_;
  CanNodeState state_;
  NmtState nmt_ = NmtState::boot_up;
  ResultBlock robots_block_;  // as shown last, before fault and range have had their say

  // What waits: each kind bounded, an answer only in its newest form.
  std::deque<CanFrame> results_, emergencies_;
  std::optional<CanFrame> sdo_answer_;
  std::optional<CanFrame> boot_up_;
  std::optional<ResultBlock> sent_;  // what results_ was last made from
  std::optional<UnderWay> under_way_;
  bool up_ = false;
  bool stalled_ = false;  // the bus takes nothing: only a probe now and then
  TimePoint next_heartbeat_, next_probe_;
};

}  // namespace zeropose
