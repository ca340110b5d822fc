// The SDO server: expedited transfers of up to four bytes (CiA 301). Pure.
#pragma once

#include "protocol/can_dictionary.h"

namespace zeropose {

namespace sdo_abort {
inline constexpr std::uint32_t unknown_command = 0x05040001, write_only = 0x06010001, read_only = 0x06010002,
                               no_such_object = 0x06020000, wrong_length = 0x06070010,
                               no_such_sub_index = 0x06090011, local_control = 0x08000021;
}  // namespace sdo_abort

struct SdoOutcome {
  std::optional<CanFrame> answer;  // none: the request was not one, or ends a transfer that we do not have
  std::optional<std::uint16_t> heartbeat_ms;  // written
  bool aborted = false;
};

// To a frame with the identifier of SDO requests to this node. Changes nothing; says what to change.
SdoOutcome answer_sdo(const CanFrame& request, const CanNodeState& state);

}  // namespace zeropose
