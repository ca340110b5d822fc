// Frames into a CAN node with a handshake behind it. What must hold is asserted. Each frame of the input is
// four bytes and its data: what else happens, the identifier, form, size.
#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <vector>

#include "protocol/can_collector.h"
#include "protocol/can_node.h"

namespace zeropose {
namespace {

using std::chrono::milliseconds;

constexpr std::uint32_t node_number = 5;

void require(bool condition, const char* what) {
  if (condition) return;
  std::fprintf(stderr, "broken: %s\n", what);
  std::abort();
}

CanOptions options_for(std::uint8_t flags) {
  CanOptions options;
  options.node = node_number;
  options.fd = (flags & 1) != 0;
  options.start_at_once = (flags & 2) == 0;
  options.heartbeat = milliseconds((flags & 4) != 0 ? 0 : 100);
  return options;
}

class Bus {
 public:
  explicit Bus(std::uint8_t flags)
      : options_(options_for(flags)),
        coding_(can_coding(options_, Convention::generic)),
        handshake_({}),
        node_(options_, Convention::generic),
        robot_(coding_) {
    handshake_.set_cell_state(cell_, now_);
    node_.link_up(now_);
    step();
  }

  void take(const CanFrame& frame) {
    const ResultBlock before = handshake_.block(now_);
    const std::uint64_t commands = node_.counters().commands;
    const NmtState state = node_.nmt_state();
    const CanTaken taken = node_.take(frame, false, now_);
    require(!(taken.command && taken.link_lost), "one thing at a time");
    if (taken.command) {
      command(frame, *taken.command, before, state);
    } else if (taken.link_lost) {
      require(frame.error || frame.id == can_id::nmt, "only bus-off and NMT end the connection");
      lose_owner();
    } else {
      require(handshake_.block(now_) == before, "a frame that is no command changes nothing");
      require(node_.counters().commands == commands, "and counts as none");
    }
    if (!frame.error && !frame.extended && !frame.remote && is_ours(frame.id))
      require(node_.fault() != CanFault::none, "a foreign sender is a fault");
    step();
  }

  void happen(std::uint8_t what) {
    const std::uint16_t amount = what >> 4;
    switch (what & 15) {
      case 1:
        now_ += milliseconds(10 * amount);
        break;
      case 2:
        report(last_.id, Code::ok, amount);
        break;
      case 3:
        report(last_.id, Code::limit_x, amount);
        break;
      case 4:
        report(last_.id + 1, Code::ok, amount);
        break;
      case 5:
        bus_takes_ = !bus_takes_;
        break;
      case 6:
        handshake_.on_exposure_done(last_.id, now_);
        break;
      case 7:
        cell_.zero_id = amount & 1u;
        cell_.cameras_alive = (amount & 6) != 0;
        handshake_.set_cell_state(cell_, now_);
        break;
      case 8:
        node_.link_down();
        lose_owner();
        break;
      case 9:
        node_.link_up(now_);
        break;
      case 10:
        node_.failed_to_write(now_);
        break;
      case 11:
        if (kept_) node_.take(*kept_, true, now_);  // a late echo
        break;
      case 12:
        robot_.expect(static_cast<std::uint16_t>(last_.id), handshake_.block(now_).epoch);
        break;
      default:
        break;
    }
    step();
  }

 private:
  static bool is_ours(std::uint32_t id) {
    for (const std::uint32_t base : {0x080u, 0x180u, 0x280u, 0x380u, 0x480u, 0x580u, 0x700u})
      if (base + node_number == id) return true;
    return false;
  }

  void command(const CanFrame& frame, const Command& command, const ResultBlock& before, NmtState state) {
    require(!frame.extended && !frame.remote && !frame.error, "only plain frames command");
    require(frame.id == 0x205 && frame.size == 8, "a command is eight bytes on RPDO1");
    require(state == NmtState::operational, "only an operational node takes commands");
    require(command.request_id <= 0xFFFF && command.job <= 0xFF, "what fits into the frame");
    const CommandOutcome outcome = handshake_.on_command(command, connection_, now_);
    if (outcome.verdict != CommandVerdict::accepted)
      require(handshake_.block(now_) == before, "a refused command changes nothing");
    if (outcome.verdict == CommandVerdict::accepted && command.kind != 6) may_be_valid_.reset();
    if (outcome.request && command.kind != 2 && command.kind != 5) last_ = *outcome.request;
    node_.answered(command, outcome.verdict);
  }

  void lose_owner() {
    handshake_.on_disconnect(connection_, now_);
    ++connection_;
  }

  void report(std::uint32_t id, Code code, std::uint16_t value) {
    Report report;
    report.request_id = id;
    report.code = code;
    report.correction.translation().x() = value;
    const bool was_busy = handshake_.block(now_).has(status_bit::busy);
    handshake_.on_report(report, now_);
    if (was_busy && id == last_.id && code == Code::ok && last_.kind == CommandKind::measure)
      may_be_valid_ = value;
  }

  void step() {
    handshake_.tick(now_);
    node_.tick(now_);
    node_.show(handshake_.block(now_));
    for (int sent = 0;; ++sent) {
      const auto frame = node_.next_frame(now_);
      if (!frame) return;
      require(sent < 40, "what waits is bounded");
      look_at(*frame);
      require(!node_.next_frame(now_), "one frame is under way at a time");
      if (!bus_takes_) {
        kept_ = *frame;
        return;
      }
      node_.take(*frame, true, now_);
      node_.show(handshake_.block(now_));
    }
  }

  void look_at(const CanFrame& frame) {
    require(is_ours(frame.id) && !frame.extended && !frame.remote && !frame.error, "our own identifiers");
    require(frame.fd == (frame.id == 0x485), "one identifier is FD");
    if (frame.id == 0x485) look_at_fd(frame);
    const auto result = robot_.take(frame, now_);
    if (!result || !result->has(can_status::valid)) return;
    require(may_be_valid_.has_value(), "valid only after an ok report for the last request");
    require(node_.fault() == CanFault::none, "nothing is valid while a fault is latched");
    require(result->request_id == last_.id, "valid only with the last request's id");
    require(result->values[0] == 100 * *may_be_valid_, "valid only with the reported value");
    require(!result->has(can_status::not_ok) && !result->has(can_status::busy), "valid alone");
  }

  void look_at_fd(const CanFrame& frame) {
    const auto result = decode_can_fd_result(frame, coding_);
    require(result.has_value(), "an FD result comes back from its frame");
    if (!(result->status & status_bit::result_valid)) {
      for (const std::int32_t value : result->values)
        require(value == invalid_value, "no values without valid");
      return;
    }
    require(may_be_valid_ && node_.fault() == CanFault::none, "valid only after an ok report, without fault");
    require(result->request_id == last_.id && result->values[0] == 1000 * *may_be_valid_, "and as reported");
    require(result->age_ms <= result->validity_ms, "valid within its validity");
  }

  const CanOptions options_;
  const CanCoding coding_;
  TimePoint now_ = TimePoint() + std::chrono::hours(1);
  CellState cell_{true, true, true, false, 1, 2, 0, false};
  Handshake handshake_;
  CanNode node_;
  CanResultCollector robot_;
  ConnectionId connection_ = 1;
  Request last_;
  std::optional<std::int32_t> may_be_valid_;
  std::optional<CanFrame> kept_;
  bool bus_takes_ = true;
};

// Mostly the identifiers that matter.
std::uint32_t identifier(std::uint8_t number) {
  constexpr std::array<std::uint32_t, 10> known = {0x205, 0x605, 0x000, 0x185, 0x285,
                                                   0x385, 0x485, 0x585, 0x705, 0x085};
  return number < 250 ? known[number % known.size()] : number * 8u;
}

void run(std::span<const std::uint8_t> data) {
  if (data.empty()) return;
  Bus bus(data[0]);
  for (std::size_t at = 1; at + 4 <= data.size();) {
    CanFrame frame;
    bus.happen(data[at]);
    frame.id = identifier(data[at + 1]);
    frame.extended = (data[at + 2] & 1) != 0;
    frame.remote = (data[at + 2] & 2) != 0;
    frame.fd = (data[at + 2] & 4) != 0;
    frame.error = (data[at + 2] & 0x18) == 0x18;
    if (frame.error) frame.id = data[at + 2] & 0x20 ? 0x100 : 0x40;
    frame.size = data[at + 3] % (frame.fd ? 65 : 9);
    at += 4;
    const std::size_t count = std::min<std::size_t>(frame.size, data.size() - at);
    std::copy_n(data.begin() + static_cast<std::ptrdiff_t>(at), count, frame.data.begin());
    at += count;
    bus.take(frame);
  }
}

}  // namespace
}  // namespace zeropose

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  zeropose::run({data, size});
  return 0;
}
