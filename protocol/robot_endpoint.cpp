#include "protocol/robot_endpoint.h"

#include <atomic>
#include <random>
#include <type_traits>
#include <utility>

namespace zeropose {
namespace {

using Clock = std::chrono::steady_clock;

HandshakeOptions with_new_epoch(HandshakeOptions options) {
  std::random_device device;
  do options.epoch = device();
  while (options.epoch == 0);
  return options;
}

}  // namespace

RobotEndpoint::RobotEndpoint(const EndpointOptions& options, RequestHandler handler)
    : options_(options), handler_(std::move(handler)), handshake_(with_new_epoch(options.handshake)) {}

// Every change of what is shown passes here, so the tap misses none.
template <class F>
auto RobotEndpoint::locked(F f) {
  const std::scoped_lock lock(mutex_);
  const TimePoint now = Clock::now();
  const auto show_to_tap = [&] {
    if (!options_.tap) return;
    const ResultBlock block = handshake_.block(now);
    if (std::exchange(tapped_sequence_, block.sequence) != block.sequence) options_.tap(block);
  };
  if constexpr (std::is_void_v<decltype(f(now))>) {
    f(now);
    show_to_tap();
  } else {
    auto result = f(now);
    show_to_tap();
    return result;
  }
}

template <class F>
void RobotEndpoint::change(F f) {
  locked(f);
  const std::scoped_lock lock(wake_mutex_);
  if (wake_) wake_();
}

void RobotEndpoint::set_cell_state(const CellState& state) {
  change([&](TimePoint now) { handshake_.set_cell_state(state, now); });
}

void RobotEndpoint::exposure_done(std::uint32_t request_id) {
  change([&](TimePoint now) { handshake_.on_exposure_done(request_id, now); });
}

// A pose that the wire cannot carry is none.
void RobotEndpoint::show_target(std::uint32_t index, const Pose& X_RH) {
  const auto values = index == 0 ? std::nullopt : to_wire(options_.handshake.convention, X_RH);
  const std::scoped_lock lock(mutex_);
  target_ = values ? TargetBlock{0, index, *values} : TargetBlock{};
}

TargetBlock RobotEndpoint::target() {
  return locked([&](TimePoint now) {
    TargetBlock target = target_;
    target.epoch = handshake_.block(now).epoch;
    return target;
  });
}

void RobotEndpoint::publish(const Report& report) {
  change([&](TimePoint now) { handshake_.on_report(report, now); });
}

ConnectionId RobotEndpoint::new_connection() {
  static std::atomic<ConnectionId> last{1};
  return ++last;
}

CommandVerdict RobotEndpoint::command(const Command& command, ConnectionId from) {
  const CommandOutcome outcome =
      locked([&](TimePoint now) { return handshake_.on_command(command, from, now); });
  if (!outcome.request) return outcome.verdict;
  // A handler that throws has not taken the request: the robot gets "internal" at once, not at the deadline.
  try {
    handler_(*outcome.request);
  } catch (...) {
    Report report;
    report.request_id = outcome.request->id;
    report.ticket = outcome.request->ticket;
    report.code = Code::internal;
    locked([&](TimePoint now) { handshake_.on_report(report, now); });
  }
  return outcome.verdict;
}

CommandVerdict RobotEndpoint::position(const PositionBlock& position, ConnectionId from) {
  return locked([&](TimePoint now) { return handshake_.on_position(position, from, now); });
}

void RobotEndpoint::disconnected(ConnectionId connection) {
  locked([&](TimePoint now) { handshake_.on_disconnect(connection, now); });
}

ResultBlock RobotEndpoint::block() {
  return locked([&](TimePoint now) { return handshake_.block(now); });
}

void RobotEndpoint::tick() {
  locked([&](TimePoint now) { handshake_.tick(now); });
}

std::optional<TimePoint> RobotEndpoint::next_event() const {
  const std::scoped_lock lock(mutex_);
  return handshake_.next_event();
}

std::optional<ConnectionId> RobotEndpoint::owner() const {
  const std::scoped_lock lock(mutex_);
  return handshake_.owner();
}

HandshakeCounters RobotEndpoint::counters() const {
  const std::scoped_lock lock(mutex_);
  return handshake_.counters();
}

void RobotEndpoint::on_change(std::function<void()> wake) {
  const std::scoped_lock lock(wake_mutex_);
  wake_ = std::move(wake);
}

}  // namespace zeropose
