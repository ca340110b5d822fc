#include "protocol/command_watch.h"

#include <utility>

namespace zeropose {

std::uint32_t request_id_of(const CommandRegisters& registers) {
  return static_cast<std::uint32_t>(registers[command_reg::request_id]) << 16 |
         registers[command_reg::request_id + 1];
}

CommandWatch::CommandWatch(bool require_crc, std::uint16_t data_id)
    : require_crc_(require_crc), data_id_(data_id) {}

void CommandWatch::start(const CommandRegisters& first_look) {
  barred_id_ = request_id_of(first_look);
  before_ = first_look;
  told_wrong_ = first_look;
  taken_.reset();
}

CommandWatch::Sight CommandWatch::look(const CommandRegisters& registers) {
  const bool settled = std::exchange(before_, registers) == registers;
  const std::uint32_t id = request_id_of(registers);
  if (id == 0 || id == barred_id_) return Sight::nothing;
  const auto command = decode_command(registers, require_crc_, data_id_);
  if (!command) {
    if (!settled || told_wrong_ == registers) return Sight::nothing;
    told_wrong_ = registers;
    return Sight::wrong_crc;
  }
  if (command == taken_ || (!require_crc_ && !settled)) return Sight::nothing;
  taken_ = command;
  return Sight::command;
}

}  // namespace zeropose
