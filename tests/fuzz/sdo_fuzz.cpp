// One request into the SDO server, with a result there and not there.
#include <algorithm>
#include <cstdio>
#include <cstdlib>

#include "protocol/can_sdo.h"

namespace zeropose {
namespace {

void require(bool condition, const char* what) {
  if (condition) return;
  std::fprintf(stderr, "broken: %s\n", what);
  std::abort();
}

bool is_known_abort(std::uint32_t code) {
  constexpr std::array<std::uint32_t, 7> known = {sdo_abort::unknown_command, sdo_abort::write_only,
                                                  sdo_abort::read_only,       sdo_abort::no_such_object,
                                                  sdo_abort::wrong_length,    sdo_abort::no_such_sub_index,
                                                  sdo_abort::local_control};
  return std::ranges::find(known, code) != known.end();
}

void check_upload(const CanFrame& request, const CanFrame& answer, const CanNodeState& state) {
  require((request.data[0] & 0xE0) == 0x40, "only a read is answered with a value");
  const FoundCanObject found =
      find_can_object(static_cast<std::uint16_t>(get_le(request.data, 1, 2)), request.data[3]);
  require(found.known_index, "a value is of an object");
  const std::size_t size = 4 - ((answer.data[0] >> 2) & 3);
  for (std::size_t i = 4 + size; i < 8; ++i) require(answer.data[i] == 0, "no more bytes than the size says");
  const bool valid = state.block.has(status_bit::result_valid);
  if (!valid && request.data[1] == 0x02 && request.data[2] == 0x20 && request.data[3] != 0)
    require(get_le(answer.data, 4, 4) == 0x80000000, "no values without valid");
}

void check(const CanFrame& request, const CanNodeState& state) {
  const SdoOutcome outcome = answer_sdo(request, state);
  require(!outcome.heartbeat_ms || (request.data[0] & 0xE0) == 0x20, "only a write writes");
  require(!(outcome.aborted && outcome.heartbeat_ms), "what is aborted writes nothing");
  if (request.size != 8) require(!outcome.answer, "a request has eight bytes");
  if (!outcome.answer) return;
  const CanFrame& answer = *outcome.answer;
  require(answer.id == 0x580 + state.coding.node && answer.size == 8, "an answer is the server's");
  require(std::equal(request.data.begin() + 1, request.data.begin() + 4, answer.data.begin() + 1),
          "an answer names the object");
  require(outcome.aborted == (answer.data[0] == 0x80), "an abort is an abort");
  if (outcome.aborted)
    require(is_known_abort(get_le(answer.data, 4, 4)), "an abort says why");
  else if (answer.data[0] == 0x60)
    require(outcome.heartbeat_ms.has_value(), "what is confirmed is written");
  else
    check_upload(request, answer, state);
}

void run(std::span<const std::uint8_t> data) {
  if (data.empty()) return;
  CanNodeState state;
  state.coding.node = 1 + data[0] % 127u;
  state.fd = (data[0] & 1) != 0;
  state.block.values = {1, 2, 3, 4, 5, 6, invalid_value, invalid_value};
  CanFrame request;
  request.id = can_id::sdo_request + state.coding.node;
  request.size = static_cast<std::uint8_t>(std::min<std::size_t>(8, data.size() - 1));
  std::copy_n(data.begin() + 1, request.size, request.data.begin());
  check(request, state);
  state.block.status = status_bit::result_valid;
  check(request, state);
}

}  // namespace
}  // namespace zeropose

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  zeropose::run({data, size});
  return 0;
}
