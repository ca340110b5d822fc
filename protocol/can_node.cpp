#include "protocol/can_node.h"

#include <algorithm>
#include <stdexcept>
#include <utility>

#include "protocol/can_collector.h"
#include "protocol/can_sdo.h"

namespace zeropose {
namespace {

using std::chrono::milliseconds;

constexpr std::size_t max_emergencies = 8;
constexpr milliseconds probe_time{100};

// Classes of error frames (linux/can/error.h).
constexpr std::uint32_t error_bus_off = 0x40, error_restarted = 0x100;

// Error codes of an emergency (CiA 301; from 0xFF00 our own).
constexpr std::uint16_t no_error = 0x0000, recovered_from_bus_off = 0x8140, identifier_collision = 0x8150,
                        answer_not_ok = 0xFF01, state_error = 0xFF02, command_refused = 0xFF03;

constexpr std::uint8_t register_any = 1, register_communication = 16, register_manufacturer = 128;

std::string said(const CanOptions& options, const std::string& what) {
  return "CAN " + options.interface + ": " + what;
}

void check(const CanOptions& options) {
  const auto refuse = [&](const char* what) { throw std::invalid_argument(said(options, what)); };
  if (options.interface.empty() || options.interface.size() > 15)
    refuse("the interface's name must have 1..15 characters");
  if (options.node < 1 || options.node > 127) refuse("the node must be 1..127");
  if (!(options.length_scale_um >= 1 && options.length_scale_um <= 10000))
    refuse("length_scale_um must be 1..10000");
  if (!(options.angle_scale_deg >= 1e-4 && options.angle_scale_deg <= 1))
    refuse("angle_scale_deg must be 0.0001..1");
  if (!(options.rotation_vector_scale_rad >= 1e-6 && options.rotation_vector_scale_rad <= 1e-3))
    refuse("rotation_vector_scale_rad must be 0.000001..0.001");
  if (options.heartbeat < milliseconds(0) || options.heartbeat > milliseconds(65535))
    refuse("the heartbeat must be 0..65535 ms");
}

bool is_answer(const ResultBlock& block) { return block.has(status_bit::not_ok); }

// The age is no change: it only goes with what is sent.
bool same_on_the_bus(const ResultBlock& a, const ResultBlock& b, bool fd) {
  if (a.request_id != b.request_id || a.epoch != b.epoch || a.code != b.code || a.values != b.values)
    return false;
  if (!fd) return can_status_of(a.status) == can_status_of(b.status);
  return a.status == b.status && a.validity_ms == b.validity_ms && a.effective_marks == b.effective_marks &&
         a.effective_cameras == b.effective_cameras;
}

}  // namespace

CanCoding can_coding(const CanOptions& options, Convention convention) {
  check(options);
  if (!fits_can(convention))
    throw std::invalid_argument(
        said(options,
             "convention " + std::string(name_of(convention)) +
                 " has no three angles, and a quaternion does not fit into a CAN frame; use Modbus or the "
                 "convention generic"));
  CanCoding coding;
  coding.node = static_cast<std::uint32_t>(options.node);
  coding.length_scale = options.length_scale_um;
  coding.angle_scale = convention == Convention::universal_robots ? options.rotation_vector_scale_rad * 1e6
                                                                  : options.angle_scale_deg * 1e4;
  coding.data_id = options.result_data_id;
  return coding;
}

CanNode::CanNode(const CanOptions& options, Convention convention) : options_(options) {
  state_.coding = can_coding(options, convention);
  state_.fd = options.fd;
  state_.heartbeat_ms = static_cast<std::uint16_t>(options.heartbeat.count());
}

bool CanNode::is_ours(std::uint32_t id) const {
  constexpr std::array<std::uint32_t, 7> sent_by_us = {
      can_id::emergency, can_id::tpdo1,      can_id::tpdo2,    can_id::tpdo3,
      can_id::result_fd, can_id::sdo_answer, can_id::heartbeat};
  return std::ranges::any_of(sent_by_us, [&](std::uint32_t base) { return base + state_.coding.node == id; });
}

bool CanNode::has_form(const CanFrame& frame, std::size_t size) {
  if (frame.size == size && (!frame.fd || options_.fd)) return true;
  ++counters_.wrong_size;
  return false;
}

CanTaken CanNode::take(const CanFrame& frame, bool own_echo, TimePoint now) {
  if (own_echo) {
    take_echo(frame);
    return {};
  }
  if (frame.error) return take_error(frame);
  const std::uint32_t node = state_.coding.node;
  if (frame.extended) {
    ++counters_.extended;
  } else if (frame.remote) {
    ++counters_.remote;
  } else if (is_ours(frame.id)) {
    ++counters_.foreign;
    latch(CanFault::foreign_sender, identifier_collision);
  } else if (frame.id == can_id::nmt) {
    return take_nmt(frame, now);
  } else if (frame.id == can_id::rpdo1 + node) {
    return take_command(frame);
  } else if (frame.id == can_id::sdo_request + node) {
    take_sdo(frame, now);
  }
  return {};
}

void CanNode::take_echo(const CanFrame& frame) {
  stalled_ = false;
  if (!under_way_ || !(under_way_->frame == frame)) {
    ++counters_.late_echoes;
    return;
  }
  ++counters_.confirmed;
  const std::uint32_t last = options_.fd ? can_id::result_fd : can_id::tpdo3;
  if (frame.id == last + state_.coding.node) ++counters_.results_confirmed;
  under_way_.reset();
}

CanTaken CanNode::take_error(const CanFrame& frame) {
  if (frame.id & error_bus_off) {
    ++counters_.bus_off;
    latch(CanFault::bus_off, recovered_from_bus_off);
    forget_pending();
    under_way_.reset();
    stalled_ = true;
    return {std::nullopt, true};
  }
  if (frame.id & error_restarted) stalled_ = false;
  return {};
}

CanTaken CanNode::take_nmt(const CanFrame& frame, TimePoint now) {
  if (!has_form(frame, 2)) return {};
  if (frame.data[1] != 0 && frame.data[1] != state_.coding.node) return {};
  ++counters_.nmt;
  switch (frame.data[0]) {
    case 0x01:
      return {std::nullopt, enter(NmtState::operational)};
    case 0x02:
      return {std::nullopt, enter(NmtState::stopped)};
    case 0x80:
      return {std::nullopt, enter(NmtState::pre_operational)};
    case 0x81:
    case 0x82:
      acknowledge_fault();
      reset(now);
      return {std::nullopt, true};
    default:
      return {};
  }
}

// True when results can no longer be sent: the owner has lost its link.
bool CanNode::enter(NmtState state) {
  const bool was_operational = nmt_ == NmtState::operational;
  if (state == nmt_) return false;
  nmt_ = state;
  results_.clear();
  sent_.reset();
  if (state == NmtState::stopped) {
    sdo_answer_.reset();
    emergencies_.clear();
  }
  return was_operational;
}

void CanNode::reset(TimePoint now) {
  forget_pending();
  state_.heartbeat_ms = static_cast<std::uint16_t>(options_.heartbeat.count());
  next_heartbeat_ = now + milliseconds(state_.heartbeat_ms);
  boot_up_ = heartbeat_frame(NmtState::boot_up);
  nmt_ = options_.start_at_once ? NmtState::operational : NmtState::pre_operational;
}

CanTaken CanNode::take_command(const CanFrame& frame) {
  if (!has_form(frame, 8)) return {};
  if (nmt_ != NmtState::operational) {
    ++counters_.not_operational;
    return {};
  }
  return {decode_can_command(frame, state_.coding.node), false};
}

void CanNode::take_sdo(const CanFrame& frame, TimePoint now) {
  if (!has_form(frame, 8)) return;
  if (nmt_ == NmtState::stopped) {
    ++counters_.not_operational;
    return;
  }
  ++counters_.sdo;
  state_.refused_commands = static_cast<std::uint32_t>(counters_.refused);
  state_.ignored_frames =
      static_cast<std::uint32_t>(counters_.wrong_size + counters_.remote + counters_.extended);
  state_.unconfirmed_frames = static_cast<std::uint32_t>(counters_.unconfirmed);
  const SdoOutcome outcome = answer_sdo(frame, state_);
  if (outcome.aborted) ++counters_.sdo_aborts;
  if (outcome.heartbeat_ms) {
    state_.heartbeat_ms = *outcome.heartbeat_ms;
    next_heartbeat_ = now + milliseconds(state_.heartbeat_ms);
  }
  if (outcome.answer) sdo_answer_ = outcome.answer;
}

void CanNode::answered(const Command& command, CommandVerdict verdict) {
  if (verdict == CommandVerdict::accepted) {
    ++counters_.commands;
    if (command.kind == static_cast<std::uint16_t>(CommandKind::reset)) acknowledge_fault();
    return;
  }
  ++counters_.refused;
  const auto reason = static_cast<std::uint8_t>(1 + static_cast<int>(verdict));
  add_emergency(command_refused, 0, command.request_id, reason);
}

void CanNode::latch(CanFault fault, std::uint16_t emergency) {
  if (state_.fault != CanFault::none) return;
  state_.fault = fault;
  update_error_register();
  add_emergency(emergency, static_cast<std::uint16_t>(Code::not_ready), 0, static_cast<std::uint8_t>(fault));
  show(ResultBlock(robots_block_));
}

void CanNode::acknowledge_fault() {
  if (state_.fault == CanFault::none) return;
  state_.fault = CanFault::none;
  update_error_register();
  add_emergency(no_error, 0, 0, 0);
}

// A latched fault hides every correction.
ResultBlock CanNode::on_this_wire(ResultBlock block) const {
  block = fit_to_can(block, state_.coding, options_.fd);
  if (state_.fault == CanFault::none) return block;
  block.status |= status_bit::error;
  block.status &= static_cast<std::uint16_t>(~status_bit::ready);
  if (block.has(status_bit::result_valid)) {
    clear_report(block);
    block.status |= status_bit::not_ok;
    block.code = static_cast<std::uint16_t>(Code::not_ready);
  }
  return block;
}

void CanNode::show(const ResultBlock& block) {
  robots_block_ = block;
  const ResultBlock before = state_.block;
  state_.block = on_this_wire(block);
  update_error_register();
  tell_errors(before, state_.block);
  if (!may_send_pdo() || !up_ || stalled_) return;
  if (sent_ && same_on_the_bus(*sent_, state_.block, options_.fd)) return;
  make_result();
}

void CanNode::tell_errors(const ResultBlock& before, const ResultBlock& after) {
  const bool another = before.request_id != after.request_id || before.code != after.code;
  if (is_answer(after) && (!is_answer(before) || another))
    add_emergency(answer_not_ok, after.code, after.request_id, 0);
  if (after.state == LinkState::error && before.state != LinkState::error)
    add_emergency(state_error, after.code, after.request_id, 0);
  if (after.state != LinkState::error && before.state == LinkState::error && state_.error_register == 0)
    add_emergency(no_error, 0, 0, 0);
}

void CanNode::update_error_register() {
  unsigned bits = 0;
  if (state_.fault != CanFault::none) bits |= register_communication | register_any;
  if (state_.block.state == LinkState::error) bits |= register_manufacturer | register_any;
  state_.error_register = static_cast<std::uint8_t>(bits);
}

void CanNode::make_result() {
  sent_ = state_.block;
  results_.clear();
  if (options_.fd) {
    results_.push_back(encode_can_fd_result(state_.block, state_.coding));
    return;
  }
  for (const CanFrame& frame : encode_can_result(state_.block, state_.coding)) results_.push_back(frame);
}

void CanNode::add_emergency(std::uint16_t error, std::uint16_t code, std::uint32_t request_id,
                            std::uint8_t detail) {
  if (nmt_ == NmtState::stopped || nmt_ == NmtState::boot_up) return;
  if (emergencies_.size() >= max_emergencies) {
    ++counters_.emergencies_dropped;
    return;
  }
  CanFrame frame;
  frame.id = can_id::emergency + state_.coding.node;
  frame.size = 8;
  put_le(frame.data, 0, 2, error);
  put_le(frame.data, 2, 1, state_.error_register);
  put_le(frame.data, 3, 2, code);
  put_le(frame.data, 5, 2, request_id);
  put_le(frame.data, 7, 1, detail);
  emergencies_.push_back(frame);
}

CanFrame CanNode::heartbeat_frame(NmtState state) const {
  CanFrame frame;
  frame.id = can_id::heartbeat + state_.coding.node;
  frame.size = 1;
  frame.data[0] = static_cast<std::uint8_t>(state);
  return frame;
}

// Emergencies of a fault outlive it: they are told when somebody can hear them.
void CanNode::forget_pending() {
  results_.clear();
  sdo_answer_.reset();
  sent_.reset();
}

void CanNode::link_up(TimePoint now) {
  ++counters_.opened;
  up_ = true;
  stalled_ = false;
  forget_pending();
  under_way_.reset();
  if (nmt_ == NmtState::boot_up) reset(now);
  next_heartbeat_ = now;
}

void CanNode::link_down() {
  ++counters_.links_lost;
  up_ = false;
  forget_pending();
  under_way_.reset();
}

void CanNode::give_up(TimePoint now) {
  ++counters_.unconfirmed;
  forget_pending();
  under_way_.reset();
  stalled_ = true;
  next_probe_ = now + probe_time;
}

void CanNode::failed_to_write(TimePoint now) { give_up(now); }

void CanNode::tick(TimePoint now) {
  if (under_way_ && now - under_way_->written >= can_result_window) give_up(now);
}

std::optional<CanFrame> CanNode::take_pending(TimePoint now) {
  const auto take_first = [](std::deque<CanFrame>& frames) {
    const CanFrame frame = frames.front();
    frames.pop_front();
    return frame;
  };
  if (boot_up_) return std::exchange(boot_up_, std::nullopt);
  if (!results_.empty()) return take_first(results_);
  if (sdo_answer_) return std::exchange(sdo_answer_, std::nullopt);
  if (!emergencies_.empty()) return take_first(emergencies_);
  if (state_.heartbeat_ms == 0 || now < next_heartbeat_) return std::nullopt;
  next_heartbeat_ = now + milliseconds(state_.heartbeat_ms);
  return heartbeat_frame(nmt_);
}

std::optional<CanFrame> CanNode::next_frame(TimePoint now) {
  if (!up_ || under_way_) return std::nullopt;
  std::optional<CanFrame> frame;
  if (!stalled_) {
    frame = take_pending(now);
  } else if (now >= next_probe_) {
    next_probe_ = now + probe_time;
    frame = heartbeat_frame(nmt_);
  }
  if (frame) under_way_ = UnderWay{*frame, now};
  return frame;
}

std::optional<TimePoint> CanNode::next_event() const {
  if (!up_) return std::nullopt;
  if (under_way_) return under_way_->written + can_result_window;
  if (stalled_) return next_probe_;
  if (boot_up_ || !results_.empty() || sdo_answer_ || !emergencies_.empty()) return TimePoint();
  if (state_.heartbeat_ms != 0) return next_heartbeat_;
  return std::nullopt;
}

}  // namespace zeropose
