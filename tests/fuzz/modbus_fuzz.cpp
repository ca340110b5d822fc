// Bytes of one connection, through framing, rules and command decoding into the handshake. What must hold is
// asserted; a frame's transaction id, which is free, says what else happens around it.
#include <algorithm>
#include <cstdio>
#include <cstdlib>

#include "protocol/handshake.h"
#include "protocol/modbus_framing.h"

namespace zeropose {
namespace {

using std::chrono::milliseconds;

void require(bool condition, const char* what) {
  if (condition) return;
  std::fprintf(stderr, "broken: %s\n", what);
  std::abort();
}

struct Frames {
  std::vector<Adu> requests;
  std::optional<FrameProblem> problem;
};

Frames frames_of(std::span<const std::uint8_t> bytes, std::size_t piece) {
  FrameReader reader(UnitSet().set(1));
  Frames frames;
  for (std::size_t at = 0; at < bytes.size(); at += piece) {
    reader.feed(bytes.subspan(at, std::min(piece, bytes.size() - at)));
    while (const auto request = reader.next()) frames.requests.push_back(*request);
  }
  frames.problem = reader.problem();
  return frames;
}

void check_request(const Adu& request) {
  require(request.size >= 8 && request.size <= modbus::max_adu, "a request has a size");
  require(request.size == 6u + request.word(4), "the size is the MBAP length's");
  require(request.word(2) == 0 && request.bytes[6] == 1, "protocol and unit are ours");
  if (request.function() == modbus::write_multiple_registers)
    require(request.size == 13u + 2u * request.quantity(), "a write has exactly its registers");
  if (request.function() == modbus::read_input_registers)
    require(request.size == 12, "a read is twelve bytes");
}

// One robot's link without sockets, and what may be valid on it.
class Link {
 public:
  explicit Link(std::uint8_t flags)
      : may_write_((flags & 1) != 0), require_crc_((flags & 2) != 0), handshake_({}) {
    handshake_.set_cell_state(cell_, now_);
  }

  void take(const Adu& request) {
    happen(request.word(0));
    const Ruling ruling = rule(request, may_write_);
    const ResultBlock before = handshake_.block(now_);
    if (ruling.kind == Ruling::Kind::command) {
      command(request, before);
    } else if (ruling.kind == Ruling::Kind::position) {
      position(request);
      require(handshake_.block(now_) == before, "a position alone changes nothing");
    } else {
      require(handshake_.block(now_) == before, "a request that is no command changes nothing");
    }
    check();
  }

 private:
  void position(const Adu& request) {
    require(may_write_, "only writers tell positions");
    const auto decoded = decode_position(written_registers(request), require_crc_);
    if (decoded) handshake_.on_position(*decoded, 1, now_);
  }

  void command(const Adu& request, const ResultBlock& before) {
    require(may_write_, "only writers command");
    const auto registers = written_registers(request);
    const auto decoded = decode_command(registers, require_crc_);
    if (!decoded) return;
    if (require_crc_)
      require(std::ranges::equal(encode_command(*decoded), registers), "a command has its CRC");
    const CommandOutcome outcome = handshake_.on_command(*decoded, 1, now_);
    if (outcome.verdict != CommandVerdict::accepted) {
      require(handshake_.block(now_) == before, "a refused command changes nothing");
      require(!outcome.request, "a refused command starts nothing");
      return;
    }
    require(!before.has(status_bit::busy), "nothing is accepted while busy");
    require(decoded->request_id != 0, "id 0 is never accepted");
    const auto kind = static_cast<CommandKind>(decoded->kind);
    if (kind != CommandKind::heartbeat) may_be_valid_.reset();
    if (outcome.request && kind != CommandKind::acknowledge && kind != CommandKind::reset)
      last_ = *outcome.request;
  }

  void happen(std::uint16_t what) {
    const std::uint16_t amount = what >> 3;
    switch (what & 7) {
      case 1:
        now_ += milliseconds(amount);
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
        handshake_.on_disconnect(1, now_);
        break;
      case 6:
        handshake_.on_exposure_done(last_.id, now_);
        break;
      case 7:
        cell_.zero_id = amount & 1u;
        cell_.cameras_alive = (amount & 6) != 0;
        handshake_.set_cell_state(cell_, now_);
        break;
      default:
        break;
    }
  }

  void report(std::uint32_t id, Code code, std::uint16_t value_um) {
    Report report;
    report.request_id = id;
    report.code = code;
    report.correction.translation().x() = value_um * 1e-3;
    const bool was_busy = handshake_.block(now_).has(status_bit::busy);
    handshake_.on_report(report, now_);
    if (was_busy && id == last_.id && code == Code::ok && last_.kind == CommandKind::measure)
      may_be_valid_ = value_um;
  }

  void check() {
    const ResultBlock block = handshake_.block(now_);
    const DecodedBlock decoded = decode_result(encode(block));
    require(!decoded.problem && decoded.block == block, "a block comes back from its registers");
    if (block.has(status_bit::result_valid)) {
      require(may_be_valid_.has_value(), "valid only after an ok report for the last request");
      require(block.request_id == last_.id, "valid only with the last request's id");
      require(block.values[0] == *may_be_valid_, "valid only with the reported value");
      require((block.status & (status_bit::busy | status_bit::not_ok | status_bit::error)) == 0,
              "valid alone");
      require(block.age_ms <= block.validity_ms, "valid within its validity");
    } else {
      require(block.values == no_values, "no values without valid");
    }
  }

  const bool may_write_, require_crc_;
  TimePoint now_ = TimePoint() + std::chrono::hours(1);
  CellState cell_{true, true, true, false, 1, 2, 0};
  Handshake handshake_;
  Request last_;
  std::optional<std::int32_t> may_be_valid_;
};

void run(std::span<const std::uint8_t> data) {
  if (data.empty()) return;
  const auto bytes = data.subspan(1);
  const Frames whole = frames_of(bytes, std::max<std::size_t>(1, bytes.size()));
  const Frames cut = frames_of(bytes, 1 + (data[0] >> 2));
  require(whole.requests.size() == cut.requests.size() && whole.problem == cut.problem,
          "cutting changes nothing");
  Link link(data[0]);
  for (std::size_t i = 0; i < whole.requests.size(); ++i) {
    require(std::ranges::equal(whole.requests[i].view(), cut.requests[i].view()), "cutting changes no byte");
    check_request(whole.requests[i]);
    link.take(whole.requests[i]);
  }
}

}  // namespace
}  // namespace zeropose

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  zeropose::run({data, size});
  return 0;
}
