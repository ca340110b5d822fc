// One robot as the daemon sees it, whatever wire it hangs on: the handshake behind a lock, with the clock.
// The cycle publishes into it; a server or client of Modbus or a CAN node takes the robot's commands to it
// and carries its block away.
#pragma once

#include <functional>
#include <mutex>
#include <optional>

#include "protocol/handshake.h"
#include "protocol/robot_link.h"

namespace zeropose {

struct EndpointOptions {
  // The epoch is drawn at every start; what is set here is not used.
  HandshakeOptions handshake;
  // Sees every block that is published, in order. Called with the endpoint locked: must be quick and not call
  // it.
  std::function<void(const ResultBlock&)> tap;
};

// Thread-safe.
class RobotEndpoint : public RobotLink {
 public:
  // The handler is called from the thread that brings the command, without a lock held. Throws
  // std::invalid_argument for an option out of range.
  RobotEndpoint(const EndpointOptions& options, RequestHandler handler);
  RobotEndpoint(const RobotEndpoint&) = delete;
  RobotEndpoint& operator=(const RobotEndpoint&) = delete;

  // For the cycle.
  void set_cell_state(const CellState& state) override;
  void exposure_done(std::uint32_t request_id) override;
  void publish(const Report& report) override;
  void show_target(std::uint32_t index, const Pose& X_RH) override;

  // For the wire. A connection's number is never used again, also not on another wire. 0 and 1 are free for a
  // wire's own events.
  static ConnectionId new_connection();
  // A command that is accepted and that the cycle has to carry out has been handed over on return.
  CommandVerdict command(const Command& command, ConnectionId from);
  CommandVerdict position(const PositionBlock& position, ConnectionId from);
  void disconnected(ConnectionId connection);
  // What the robot gets that reads now, with its age.
  ResultBlock block();
  // Where its hand shall go, with the epoch of now.
  TargetBlock target();
  // Publishes the time-out at the deadline and withdraws a result at the end of its validity; the wire calls
  // it at next_event() at the latest.
  void tick();
  std::optional<TimePoint> next_event() const;
  std::optional<ConnectionId> owner() const;
  HandshakeCounters counters() const;
  const HandshakeOptions& options() const { return options_.handshake; }

  // Called after every change that the cycle makes, without a lock held, from any thread: the wire's own
  // thread has to look again. Set before the first command and unset (nullptr) before the wire goes.
  void on_change(std::function<void()> wake);

 private:
  template <class F>
  auto locked(F f);
  template <class F>
  void change(F f);

  const EndpointOptions options_;
  const RequestHandler handler_;
  mutable std::mutex mutex_;  // guards what follows
  Handshake handshake_;
  std::optional<std::uint16_t> tapped_sequence_;
  TargetBlock target_;
  std::mutex wake_mutex_;
  std::function<void()> wake_;
};

}  // namespace zeropose
