#include "protocol/handshake.h"

#include <algorithm>
#include <stdexcept>
#include <utility>

namespace zeropose {
namespace {

using std::chrono::milliseconds;

// A cycle that has not reported after this time never will: the watchdog has long restarted it.
constexpr std::chrono::seconds abandoned_for{60};
constexpr std::size_t max_abandoned = 1024;

bool same_basis(const CellState& a, const CellState& b) {
  return a.config_hash == b.config_hash && a.calibration_hash == b.calibration_hash &&
         a.zero_id == b.zero_id && a.simulated == b.simulated;
}

// Rounded up: never younger than it is.
std::uint16_t age_ms(TimePoint published, TimePoint now) {
  const auto age = std::chrono::ceil<milliseconds>(now - published).count();
  return static_cast<std::uint16_t>(std::clamp<decltype(age)>(age, 0, not_representable));
}

bool latches_error(Code code) { return static_cast<int>(code) >= 900; }

void check(const HandshakeOptions& options) {
  const auto refuse = [](const char* what) {
    throw std::invalid_argument(std::string("robot link: ") + what);
  };
  if (options.validity < milliseconds(1) || options.validity > milliseconds(65535))
    refuse("validity must be 1..65535 ms");
  if (options.measure_deadline <= milliseconds(0) || options.zero_deadline <= milliseconds(0))
    refuse("deadlines must be positive");
  if (options.epoch == 0) refuse("session epoch 0 is not allowed");
  if (!to_wire(options.convention, Pose::Identity())) refuse("this convention is never on the wire");
}

}  // namespace

Handshake::Handshake(const HandshakeOptions& options) : options_(options), epoch_(options.epoch) {
  check(options);
  shown_ = compose();
}

bool Handshake::is_ready() const { return cell_.config_valid && cell_.cameras_alive && cell_.zero_valid; }

LinkState Handshake::state() const {
  if (error_) return LinkState::error;
  if (halted_) return LinkState::halted;
  if (execution_) return LinkState::single_execution;
  if (!cell_.config_valid) return LinkState::preoperational;
  return is_ready() ? LinkState::ready : LinkState::initialized;
}

std::uint16_t Handshake::status() const {
  unsigned bits = 0;
  if (state() == LinkState::ready) bits |= status_bit::ready;
  if (execution_) bits |= status_bit::busy;
  if (execution_ ? execution_->exposure_done : answer_ && answer_->exposure_done)
    bits |= status_bit::exposure_done;
  if (error_) bits |= status_bit::error;
  if (cell_.simulated) bits |= status_bit::simulated;
  if (!cell_.zero_valid) bits |= status_bit::zero_missing;
  if (cell_.camera_moved) bits |= status_bit::camera_moved;
  return static_cast<std::uint16_t>(bits);
}

ResultBlock Handshake::compose() const {
  ResultBlock block = answer_ && !execution_ ? answer_->fields : ResultBlock{};
  if (execution_ && !execution_->orphaned) {
    block.request_id = execution_->request.id;
    block.job = execution_->request.job;
    block.part = execution_->request.part;
  } else if (answer_ && !execution_) {
    block.request_id = answer_->id;
    block.job = answer_->job;
    block.part = answer_->part;
  }
  block.sequence = shown_.sequence;
  block.epoch = epoch_;
  block.robot_index = options_.robot_index;
  block.state = state();
  block.status |= status();
  block.convention = static_cast<std::uint16_t>(options_.convention);
  block.frame = options_.frame;
  block.validity_ms = static_cast<std::uint16_t>(options_.validity.count());
  block.config_hash = cell_.config_hash;
  block.calibration_hash = cell_.calibration_hash;
  block.zero_id = cell_.zero_id;
  return block;
}

void Handshake::refresh() {
  ResultBlock next = compose();
  if (next == shown_) return;
  ++next.sequence;
  shown_ = next;
}

ResultBlock Handshake::block(TimePoint now) {
  tick(now);
  ResultBlock block = shown_;
  if (answer_) block.age_ms = age_ms(answer_->published, now);
  return block;
}

std::optional<TimePoint> Handshake::next_event() const {
  if (execution_) return execution_->request.deadline;
  if (answer_ && answer_->valid()) return answer_->published + options_.validity;
  return std::nullopt;
}

void Handshake::tick(TimePoint now) {
  if (execution_ && now >= execution_->request.deadline) {
    const Execution late = *execution_;
    abandon(late.request.id, now);
    ++counters_.timeouts;
    Report report;
    report.code = Code::result_timeout;
    publish(late, report, now);
  }
  if (answer_ && answer_->valid() && now >= answer_->published + options_.validity) {
    answer_.reset();
    ++counters_.expired;
  }
  refresh();
}

void Handshake::set_cell_state(const CellState& cell, TimePoint now) {
  tick(now);
  const bool other_basis = !same_basis(cell, cell_);
  cell_ = cell;
  if (answer_ && answer_->valid() && (other_basis || !is_ready() || cell_.camera_moved)) answer_.reset();
  refresh();
}

void Handshake::abandon(std::uint32_t request_id, TimePoint now) {
  abandoned_.push_back({request_id, now + abandoned_for});
  if (abandoned_.size() > max_abandoned) abandoned_.pop_front();
}

bool Handshake::is_abandoned(std::uint32_t request_id, TimePoint now) {
  std::erase_if(abandoned_, [&](const Abandoned& entry) { return now >= entry.until; });
  return std::ranges::find(abandoned_, request_id, &Abandoned::id) != abandoned_.end();
}

CommandVerdict Handshake::refuse(CommandVerdict verdict) {
  switch (verdict) {
    case CommandVerdict::busy:
      ++counters_.refused_busy;
      break;
    case CommandVerdict::wrong_request_id:
      ++counters_.refused_request_id;
      break;
    case CommandVerdict::wrong_acknowledge:
      ++counters_.refused_acknowledge;
      break;
    case CommandVerdict::wrong_argument:
      ++counters_.refused_argument;
      break;
    case CommandVerdict::accepted:
      break;
  }
  return verdict;
}

CommandOutcome Handshake::on_command(const Command& command, ConnectionId from, TimePoint now) {
  tick(now);
  if (execution_) return {refuse(CommandVerdict::busy), {}};
  if (command.kind == static_cast<std::uint16_t>(CommandKind::acknowledge)) return acknowledge(command, from);
  if (command.request_id == 0 || command.request_id == last_id_ || is_abandoned(command.request_id, now))
    return {refuse(CommandVerdict::wrong_request_id), {}};
  if (command.kind == static_cast<std::uint16_t>(CommandKind::heartbeat)) {
    if (command.argument != 0) return {refuse(CommandVerdict::wrong_argument), {}};
    ++counters_.heartbeats;
    return {CommandVerdict::accepted, {}};
  }
  answer_.reset();
  last_id_ = command.request_id;
  owner_ = from;
  ++counters_.accepted;
  const CommandOutcome outcome = take(command, from, now);
  refresh();
  return outcome;
}

// Also after the answer has been withdrawn for another reason, and again: then there is nothing left to do.
CommandOutcome Handshake::acknowledge(const Command& command, ConnectionId from) {
  if (command.request_id == 0 || command.request_id != last_id_ || owner_ != from)
    return {refuse(CommandVerdict::wrong_acknowledge), {}};
  if (command.argument != 0) return {refuse(CommandVerdict::wrong_argument), {}};
  ++counters_.accepted;
  answer_.reset();
  CommandOutcome outcome{CommandVerdict::accepted, {}};
  if (error_) {
    error_ = false;
    outcome.request = Request{options_.robot, CommandKind::reset, command.request_id, 0, 0, 0, {}, {},
                              ++tickets_,     Pose::Identity()};
  }
  refresh();
  return outcome;
}

Code Handshake::why_not(const Command& command) const {
  const auto kind = static_cast<CommandKind>(command.kind);
  if (kind == CommandKind::zero && command.argument != zero_guard) return Code::zero_guard_wrong;
  if (kind == CommandKind::select_job && command.argument != 0) return Code::argument_out_of_range;
  if (error_) return Code::not_ready;
  if (halted_) return Code::halted;
  if (!cell_.config_valid) return Code::not_ready;
  if (kind == CommandKind::select_job) return Code::ok;
  if (!cell_.cameras_alive) return Code::camera_missing;
  if (kind == CommandKind::measure && !cell_.zero_valid) return Code::zero_missing;
  return Code::ok;
}

CommandOutcome Handshake::take(const Command& command, ConnectionId from, TimePoint now) {
  const Code argument = command.argument == 0 ? Code::ok : Code::argument_out_of_range;
  switch (static_cast<CommandKind>(command.kind)) {
    case CommandKind::measure:
    case CommandKind::zero:
    case CommandKind::select_job: {
      const Code code = why_not(command);
      return code == Code::ok ? start(command, now) : answer_at_once(command, code, now);
    }
    case CommandKind::at_position:
      return at_position(command, from, now);
    case CommandKind::halt:
      if (argument == Code::ok) halted_ = true;
      return answer_at_once(command, argument, now);
    case CommandKind::resume:
      if (argument == Code::ok) halted_ = false;
      return answer_at_once(command, argument, now);
    case CommandKind::reset: {
      if (argument == Code::ok) error_ = false;
      CommandOutcome outcome = answer_at_once(command, argument, now);
      if (argument == Code::ok) outcome.request = request_of(command, now);
      return outcome;
    }
    default:
      return answer_at_once(command, Code::unknown_command, now);
  }
}

CommandVerdict Handshake::on_position(const PositionBlock& position, ConnectionId from, TimePoint now) {
  tick(now);
  if (execution_) return refuse(CommandVerdict::busy);
  const auto X_RH = from_wire(options_.convention, position.values);
  if (!X_RH) return refuse(CommandVerdict::wrong_argument);
  position_ = Position{position.index, *X_RH, from};
  return CommandVerdict::accepted;
}

CommandOutcome Handshake::at_position(const Command& command, ConnectionId from, TimePoint now) {
  const auto position = std::exchange(position_, std::nullopt);
  const bool told =
      position && position->from == from && position->index == static_cast<std::uint32_t>(command.argument);
  const Code code = told ? why_not(command) : Code::argument_out_of_range;
  if (code != Code::ok) return answer_at_once(command, code, now);
  CommandOutcome outcome = start(command, now);
  outcome.request->X_RH = position->X_RH;
  return outcome;
}

Request Handshake::request_of(const Command& command, TimePoint now) {
  const auto kind = static_cast<CommandKind>(command.kind);
  // At a position a board may be looked for; nobody waits there for a correction.
  const bool unhurried = kind == CommandKind::zero || kind == CommandKind::at_position;
  const auto time = unhurried ? options_.zero_deadline : options_.measure_deadline;
  Request request;
  request.robot = options_.robot;
  request.kind = kind;
  request.id = command.request_id;
  request.job = command.job;
  request.part = command.part;
  request.argument = command.argument;
  request.received = now;
  request.deadline = now + time;
  request.ticket = ++tickets_;
  return request;
}

CommandOutcome Handshake::start(const Command& command, TimePoint now) {
  execution_ = Execution{request_of(command, now), cell_};
  return {CommandVerdict::accepted, execution_->request};
}

// Code ok: done, without a correction.
CommandOutcome Handshake::answer_at_once(const Command& command, Code code, TimePoint now) {
  answer_ = Answer{command.request_id, command.job, command.part, false, now, {}};
  if (code != Code::ok) {
    Report report;
    report.code = code;
    put_report(report, options_.convention, answer_->fields);
    ++counters_.not_ok_results;
  }
  return {CommandVerdict::accepted, {}};
}

void Handshake::on_exposure_done(std::uint32_t request_id, TimePoint now) {
  tick(now);
  if (execution_ && execution_->request.id == request_id) execution_->exposure_done = true;
  refresh();
}

void Handshake::on_report(const Report& report, TimePoint now) {
  tick(now);
  const bool fits = execution_ && execution_->request.id == report.request_id &&
                    (report.ticket == 0 || report.ticket == execution_->request.ticket);
  if (!fits) {
    ++counters_.late_reports;
    const auto it = std::ranges::find(abandoned_, report.request_id, &Abandoned::id);
    if (it != abandoned_.end()) abandoned_.erase(it);
    return;
  }
  const Execution execution = *execution_;
  publish(execution, report, now);
  refresh();
}

// A result that is ok counts only in a cell that is still ready and still the one it was asked of.
Code Handshake::code_of(const Execution& execution, const Report& report) const {
  if (report.code != Code::ok || execution.request.kind != CommandKind::measure) return report.code;
  if (!cell_.config_valid) return Code::not_ready;
  if (!cell_.cameras_alive) return Code::camera_missing;
  if (!cell_.zero_valid) return Code::zero_missing;
  if (cell_.camera_moved) return Code::camera_moved;
  return same_basis(cell_, execution.cell) ? Code::ok : Code::zero_outdated;
}

void Handshake::publish(const Execution& execution, const Report& report, TimePoint now) {
  execution_.reset();
  Report final_report = report;
  final_report.code = code_of(execution, report);
  if (latches_error(final_report.code)) error_ = true;
  if (execution.orphaned) {
    ++counters_.orphaned_reports;
    return;
  }
  const Request& request = execution.request;
  answer_ = Answer{request.id, request.job, request.part, execution.exposure_done, now, {}};
  const bool is_measure = request.kind == CommandKind::measure;
  if (is_measure || final_report.code != Code::ok)
    put_report(final_report, options_.convention, answer_->fields);
  if (answer_->valid()) answer_->exposure_done = true;
  if (answer_->valid()) ++counters_.valid_results;
  if (answer_->fields.has(status_bit::not_ok)) ++counters_.not_ok_results;
}

void Handshake::on_disconnect(ConnectionId connection, TimePoint now) {
  tick(now);
  if (owner_ != connection) return;
  owner_.reset();
  answer_.reset();
  if (execution_) execution_->orphaned = true;
  if (++epoch_ == 0) epoch_ = 1;
  refresh();
}

}  // namespace zeropose
