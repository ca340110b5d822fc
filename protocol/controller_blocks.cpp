#include "protocol/controller_blocks.h"

#include <algorithm>

namespace zeropose {
namespace {

ModbusPeerOptions peer_options(const ModbusClientOptions& options) {
  return {options.where, options.unit, options.response_timeout, options.result_data_id,
          options.command_data_id};
}

}  // namespace

ControllerBlocks::ControllerBlocks(const ModbusClientOptions& options, Events events)
    : options_(options), events_(std::move(events)), peer_(peer_options(options)) {}

void ControllerBlocks::report(const PeerFailure& failure, Counter refused) {
  switch (failure.problem) {
    case PeerProblem::cannot_connect:
      events_.count(&ModbusClientCounters::cannot_connect);
      break;
    case PeerProblem::no_answer:
      events_.count(&ModbusClientCounters::no_answer);
      break;
    case PeerProblem::wrong_answer:
      events_.count(&ModbusClientCounters::wrong_answer);
      break;
    case PeerProblem::refused:
      events_.count(refused);
      break;
    case PeerProblem::not_connected:
    case PeerProblem::connection_lost:
      events_.count(&ModbusClientCounters::connection_lost);
      break;
  }
  events_.failed(failure);
}

bool ControllerBlocks::connect() {
  events_.asking();
  const auto failure = peer_.connect();
  if (failure) report(*failure, &ModbusClientCounters::cannot_connect);
  return !failure;
}

RegisterAnswer ControllerBlocks::read(std::size_t address, std::size_t count) {
  events_.asking();
  RegisterAnswer answer =
      peer_.read_holding(static_cast<std::uint16_t>(address), static_cast<std::uint16_t>(count));
  if (answer.failure) report(*answer.failure, &ModbusClientCounters::refused_reads);
  return answer;
}

bool ControllerBlocks::write(std::size_t address, std::span<const std::uint16_t> registers) {
  events_.asking();
  const auto failure = peer_.write(static_cast<std::uint16_t>(address), registers);
  if (failure) report(*failure, &ModbusClientCounters::refused_writes);
  return !failure;
}

std::optional<CommandRegisters> ControllerBlocks::read_command() {
  const RegisterAnswer answer = read(options_.command_address, command_reg::block_size);
  if (answer.failure) return std::nullopt;
  CommandRegisters registers{};
  std::ranges::copy(answer.registers, registers.begin());
  return registers;
}

// Ascending, so that the CRC and the sequence number at the end come last. That number is made wrong before:
// the same sequence number may stand there with another content from an earlier session.
bool ControllerBlocks::write_block(const ResultRegisters& block) {
  const std::size_t part = options_.max_registers;
  if (part < block.size()) {
    const std::uint16_t torn[] = {static_cast<std::uint16_t>(~block[reg::sequence_end])};
    if (!write(options_.result_address + reg::sequence_end, torn)) return false;
  }
  for (std::size_t first = 0; first < block.size(); first += part) {
    const std::size_t count = std::min(part, block.size() - first);
    if (!write(options_.result_address + first, std::span(block).subspan(first, count))) return false;
  }
  return true;
}

std::optional<ResultRegisters> ControllerBlocks::read_back() {
  ResultRegisters block{};
  for (std::size_t first = 0; first < block.size(); first += options_.max_registers) {
    const std::size_t count = std::min(options_.max_registers, block.size() - first);
    const RegisterAnswer answer = read(options_.result_address + first, count);
    if (answer.failure) return std::nullopt;
    std::ranges::copy(answer.registers, block.begin() + static_cast<std::ptrdiff_t>(first));
  }
  return block;
}

bool ControllerBlocks::store(const ResultRegisters& block) {
  if (!write_block(block)) return false;
  const auto stored = read_back();
  if (!stored) return false;
  if (*stored == block) {
    events_.count(&ModbusClientCounters::blocks_written);
    return true;
  }
  events_.count(&ModbusClientCounters::read_back_wrong);
  const auto at = std::ranges::mismatch(*stored, block).in1 - stored->begin();
  events_.failed({PeerProblem::wrong_answer, 0,
                  "Modbus: the controller has not stored what was written to register " +
                      std::to_string(options_.result_address + at) +
                      "; does its program or another client write there?"});
  return false;
}

bool ControllerBlocks::write_life(std::uint16_t counter, std::uint32_t request_id, std::uint16_t exception) {
  const std::uint16_t life[] = {counter, static_cast<std::uint16_t>(request_id >> 16),
                                static_cast<std::uint16_t>(request_id & 0xFFFF), exception};
  return write(options_.life_address, life);
}

}  // namespace zeropose
