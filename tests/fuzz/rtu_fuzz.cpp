// Bytes of a serial line with gaps between them, through framing, rules and command decoding; and the same as
// what a controller's command block holds at one look after the other. What must hold is asserted.
#include <algorithm>
#include <cstdio>
#include <cstdlib>

#include "protocol/command_watch.h"
#include "protocol/rtu_framing.h"

namespace zeropose {
namespace {

using std::chrono::microseconds;
using Bytes = std::vector<std::uint8_t>;

constexpr std::uint8_t unit = 1;
constexpr microseconds silence{2000};

void require(bool condition, const char* what) {
  if (condition) return;
  std::fprintf(stderr, "broken: %s\n", what);
  std::abort();
}

// What was sent between two silences, and a reader that must see just that.
class Line {
 public:
  explicit Line(bool patient) : reader_(unit, silence, patient ? 10 * silence : microseconds(0)) {}

  void send(std::span<const std::uint8_t> bytes, microseconds gap) {
    now_ += gap;
    look();
    if (bytes.empty()) return;
    reader_.feed(bytes, now_);
    sent_.insert(sent_.end(), bytes.begin(), bytes.end());
  }
  void look() {
    const auto frame = reader_.take(now_);
    if (!frame) return;
    require(!sent_.empty(), "no frame without bytes");
    if (!frame->problem) check(frame->request);
    sent_.clear();
    require(!reader_.take(now_) && !reader_.frame_end(), "one frame per silence");
  }

 private:
  void check(const Adu& request) {
    require(request.size >= 8 && request.size <= modbus::max_adu, "a request has a size");
    require(request.bytes[6] == unit && request.function() < 0x80, "it is for us, and a request");
    require(encode_rtu(request.view()) == sent_, "it is all that stood between the silences");
    if (rule(request, true).kind != Ruling::Kind::command) return;
    require(request.size == 33, "a command has its ten registers");
    const auto registers = written_registers(request);
    const auto command = decode_command(registers);
    require(!command || std::ranges::equal(encode_command(*command), registers), "a command has its CRC");
  }

  RtuReader reader_;
  RtuReader::TimePoint now_{std::chrono::hours(1)};
  Bytes sent_;
};

// Pieces: how long before, whether a right CRC is to be added, how many bytes.
void run_line(std::span<const std::uint8_t> data, bool patient) {
  Line line(patient);
  while (data.size() >= 2) {
    const microseconds gap = (data[0] & 0x7F) * microseconds(250);
    const bool with_crc = (data[0] & 0x80) != 0;
    const std::size_t size = std::min<std::size_t>(data[1], data.size() - 2);
    Bytes piece(data.begin() + 2, data.begin() + 2 + static_cast<std::ptrdiff_t>(size));
    data = data.subspan(2 + size);
    if (with_crc) {
      const std::uint16_t crc = crc16_modbus(piece);
      piece.push_back(static_cast<std::uint8_t>(crc & 0xFF));
      piece.push_back(static_cast<std::uint8_t>(crc >> 8));
    }
    line.send(piece, gap);
  }
  line.send({}, 100 * silence);
}

// Each step changes a register, makes the CRC right, or only looks again.
void run_watch(std::span<const std::uint8_t> data, bool require_crc) {
  CommandRegisters now{};
  CommandWatch watch(require_crc);
  std::uint32_t barred = 0;
  std::optional<Command> last;
  for (; data.size() >= 3; data = data.subspan(3)) {
    const auto value = static_cast<std::uint16_t>(data[1] << 8 | data[2]);
    const std::uint8_t what = data[0] % 16;
    if (what < now.size()) now[what] = value;
    const auto free = decode_command(now, false);
    if (what == 10) now = encode_command(*free);
    if (what == 11) {
      watch.start(now);
      barred = request_id_of(now);
      last.reset();
    }
    if (watch.look(now) != CommandWatch::Sight::command) continue;
    require(request_id_of(now) != 0 && request_id_of(now) != barred, "never what stood there");
    require(watch.command() == *decode_command(now, false), "the command is what stands there");
    require(!require_crc || encode_command(watch.command()) == now, "a command has its CRC");
    require(watch.command() != last, "a command is taken once");
    last = watch.command();
  }
}

}  // namespace
}  // namespace zeropose

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) return 0;
  const std::span<const std::uint8_t> bytes(data + 1, size - 1);
  if ((data[0] & 1) != 0)
    zeropose::run_line(bytes, (data[0] & 2) != 0);
  else
    zeropose::run_watch(bytes, (data[0] & 2) != 0);
  return 0;
}
