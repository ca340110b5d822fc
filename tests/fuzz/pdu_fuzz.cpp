// One PDU of any bytes as a whole frame, through the rules and libmodbus to the answer. The first byte says
// whether the client may write, and whether commands need a CRC.
#include <cstdio>
#include <cstdlib>
#include <optional>

#include "protocol/modbus_framing.h"
#include "protocol/modbus_reply.h"
#include "protocol/modbus_unit.h"

namespace zeropose {
namespace {

void require(bool condition, const char* what) {
  if (condition) return;
  std::fprintf(stderr, "broken: %s\n", what);
  std::abort();
}

std::optional<Adu> framed(std::span<const std::uint8_t> pdu) {
  const std::size_t length = pdu.size() + 1;
  std::vector<std::uint8_t> bytes{
      0x12, 0x34, 0, 0, static_cast<std::uint8_t>(length >> 8), static_cast<std::uint8_t>(length & 0xFF), 1};
  bytes.insert(bytes.end(), pdu.begin(), pdu.end());
  FrameReader reader(UnitSet().set(1));
  reader.feed(bytes);
  return reader.next();
}

void check_answer(const Adu& request, std::span<const std::uint8_t> answer, bool changed, bool may_write) {
  require(answer.size() >= 9, "an answer is a header, a function and something");
  require(answer[0] == 0x12 && answer[1] == 0x34, "the transaction is the request's");
  require(answer[2] == 0 && answer[3] == 0 && answer[6] == 1, "protocol and unit are ours");
  require(static_cast<std::size_t>(answer[4] << 8 | answer[5]) == answer.size() - 6,
          "the length is the answer's");
  const bool exception = (answer[7] & 0x80) != 0;
  require((answer[7] & 0x7F) == (request.function() & 0x7F), "the function is the request's");
  if (exception)
    require(answer.size() == 9 && answer[8] >= 1 && answer[8] <= 6, "an exception is one number");
  const bool reads = request.function() == modbus::read_holding_registers ||
                     request.function() == modbus::read_input_registers;
  if (!exception && reads)
    require(answer[8] == 2 * request.quantity() && answer.size() == 9u + answer[8],
            "a read has its registers");
  if (!exception && !reads)
    require(request.function() == modbus::write_multiple_registers && may_write && answer.size() == 12,
            "nothing is written but by FC16 of one who may");
  if (exception || reads) require(!changed, "what is refused or read changes nothing");
}

void take(std::span<const std::uint8_t> bytes) {
  if (bytes.size() < 2 || bytes.size() > 254) return;
  const bool may_write = (bytes[0] & 1) != 0;
  ModbusUnit unit;
  unit.require_command_crc = (bytes[0] & 2) != 0;
  static ModbusReply reply;
  RobotEndpoint endpoint({}, [](const Request&) {});
  endpoint.set_cell_state({true, true, true, false, 1, 2, 3, false});
  const auto request = framed(bytes.subspan(1));
  if (!request) return;
  const HandshakeCounters before = endpoint.counters();
  ModbusUnitCounters counters;
  const auto answer = ModbusUnitServer(unit, endpoint).answer(*request, 2, may_write, reply, counters);
  const HandshakeCounters after = endpoint.counters();
  const bool changed = after.accepted != before.accepted || after.heartbeats != before.heartbeats;
  check_answer(*request, answer, changed, may_write);
}

}  // namespace
}  // namespace zeropose

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  zeropose::take({data, size});
  return 0;
}
