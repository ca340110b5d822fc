#include "protocol/can_sdo.h"

#include <algorithm>

namespace zeropose {
namespace {

constexpr unsigned command_mask = 0xE0, download = 0x20, upload = 0x40, abort_transfer = 0x80;
constexpr unsigned expedited = 0x02, size_indicated = 0x01;

struct SdoRequest {
  unsigned head = 0;
  std::uint16_t index = 0;
  std::uint8_t sub = 0;
};

SdoRequest request_in(const CanFrame& frame) {
  return {frame.data[0], static_cast<std::uint16_t>(get_le(frame.data, 1, 2)), frame.data[3]};
}

CanFrame answer_frame(const CanFrame& request, const CanNodeState& state, unsigned head, std::uint32_t data) {
  CanFrame frame;
  frame.id = can_id::sdo_answer + state.coding.node;
  frame.size = 8;
  put_le(frame.data, 0, 1, head);
  std::copy_n(request.data.begin() + 1, 3, frame.data.begin() + 1);
  put_le(frame.data, 4, 4, data);
  return frame;
}

SdoOutcome aborted(const CanFrame& request, const CanNodeState& state, std::uint32_t code) {
  return {answer_frame(request, state, abort_transfer, code), {}, true};
}

CanFrame uploaded(const CanFrame& request, const CanNodeState& state, std::size_t size, std::uint32_t value) {
  const auto unused = static_cast<unsigned>(4 - size);
  return answer_frame(request, state, upload | (unused << 2) | expedited | size_indicated, value);
}

SdoOutcome read(const CanFrame& frame, const FoundCanObject& found, std::uint8_t sub,
                const CanNodeState& state) {
  if (sub == 0 && found.sub_count > 0) return {uploaded(frame, state, 1, found.sub_count), {}, false};
  if (!found.object) return aborted(frame, state, sdo_abort::no_such_sub_index);
  if (found.object->access == CanAccess::pdo_only) return aborted(frame, state, sdo_abort::write_only);
  return {uploaded(frame, state, found.object->size(), found.object->read(state)), {}, false};
}

// The heartbeat time is the only object that can be written.
SdoOutcome write(const CanFrame& frame, const FoundCanObject& found, std::uint8_t sub,
                 const CanNodeState& state) {
  const unsigned head = frame.data[0];
  if (!(head & expedited)) return aborted(frame, state, sdo_abort::unknown_command);
  if (sub == 0 && found.sub_count > 0) return aborted(frame, state, sdo_abort::read_only);
  if (!found.object) return aborted(frame, state, sdo_abort::no_such_sub_index);
  if (found.object->access == CanAccess::pdo_only) return aborted(frame, state, sdo_abort::local_control);
  if (found.object->access != CanAccess::read_write) return aborted(frame, state, sdo_abort::read_only);
  const std::size_t sent = 4 - ((head >> 2) & 3);
  if ((head & size_indicated) && sent != found.object->size())
    return aborted(frame, state, sdo_abort::wrong_length);
  return {answer_frame(frame, state, 0x60, 0), static_cast<std::uint16_t>(get_le(frame.data, 4, 2)), false};
}

}  // namespace

SdoOutcome answer_sdo(const CanFrame& frame, const CanNodeState& state) {
  if (frame.size != 8) return {};
  const SdoRequest request = request_in(frame);
  const unsigned command = request.head & command_mask;
  if (command == abort_transfer) return {};
  if (command != upload && command != download) return aborted(frame, state, sdo_abort::unknown_command);
  const FoundCanObject found = find_can_object(request.index, request.sub);
  if (!found.known_index) return aborted(frame, state, sdo_abort::no_such_object);
  return command == upload ? read(frame, found, request.sub, state) : write(frame, found, request.sub, state);
}

}  // namespace zeropose
