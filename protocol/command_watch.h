// A command block that the robot's side owns and the house looks at again and again: when is it a new
// command? Pure.
//
// A command is new when it differs from the last one that was taken. It need not have been written in one
// piece: a block with a wrong CRC may be half written and is looked at again.
//
// What stood there at the first look is never carried out: it may be an hour old. Its request id stays barred
// as long as the connection lasts, so that a half-written block is not completed into an old command either.
// The robot sees a new session epoch and asks again with a new id.
#pragma once

#include <optional>

#include "protocol/codec.h"

namespace zeropose {

class CommandWatch {
 public:
  enum class Sight {
    nothing,    // as before, barred, or perhaps half written
    wrong_crc,  // seen twice alike, so it is not being written; told once
    command     // a new one: carry it out
  };
  // Without a CRC a command is taken only when two looks in succession saw it alike; the robot must write the
  // low word of the request id last.
  explicit CommandWatch(bool require_crc = true, std::uint16_t data_id = default_command_data_id);

  // At the beginning of each connection.
  void start(const CommandRegisters& first_look);
  Sight look(const CommandRegisters& registers);
  // After Sight::command.
  const Command& command() const { return *taken_; }

 private:
  bool require_crc_;
  std::uint16_t data_id_;
  std::uint32_t barred_id_ = 0;
  CommandRegisters before_{};
  std::optional<CommandRegisters> told_wrong_;
  std::optional<Command> taken_;
};

// As it stands in the registers, whatever the CRC says.
std::uint32_t request_id_of(const CommandRegisters& registers);

}  // namespace zeropose
