#include "protocol/modbus_reply.h"

#include <modbus.h>
#include <sys/socket.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <stdexcept>
#include <string>

namespace zeropose {
namespace {

// From the command block to the position block's end; which of them may be written is decided before.
constexpr unsigned writable_registers = position_reg::first + position_reg::block_size - command_reg::first;

struct FreeContext {
  void operator()(modbus_t* context) const { modbus_free(context); }
};
struct FreeMapping {
  void operator()(modbus_mapping_t* mapping) const { modbus_mapping_free(mapping); }
};

[[noreturn]] void fail(const char* what) {
  throw std::runtime_error(std::string("Modbus: ") + what + ": " + std::strerror(errno));
}

}  // namespace

struct ModbusReply::Library {
  std::unique_ptr<modbus_t, FreeContext> context{modbus_new_tcp(nullptr, 0)};
  // Input registers 0..60 and the same as holding registers.
  std::unique_ptr<modbus_mapping_t, FreeMapping> result{modbus_mapping_new_start_address(
      0, 0, 0, 0, 0, static_cast<unsigned>(reg::block_size), 0, static_cast<unsigned>(reg::block_size))};
  // The same of the target block.
  std::unique_ptr<modbus_mapping_t, FreeMapping> target{modbus_mapping_new_start_address(
      0, 0, 0, 0, static_cast<unsigned>(target_reg::first), static_cast<unsigned>(target_reg::block_size),
      static_cast<unsigned>(target_reg::first), static_cast<unsigned>(target_reg::block_size))};
  std::unique_ptr<modbus_mapping_t, FreeMapping> command{modbus_mapping_new_start_address(
      0, 0, 0, 0, static_cast<unsigned>(command_reg::first), writable_registers, 0, 0)};
};

ModbusReply::ModbusReply() : library_(std::make_unique<Library>()) {
  if (!library_->context || !library_->result || !library_->target || !library_->command) fail("no memory");
  int ends[2] = {-1, -1};
  if (socketpair(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0, ends) != 0) fail("socketpair");
  library_end_ = Descriptor(ends[0]);
  our_end_ = Descriptor(ends[1]);
  modbus_set_socket(library_->context.get(), library_end_.get());
  // Else libmodbus sleeps half a second before some exceptions. 0, 0 is refused.
  if (modbus_set_response_timeout(library_->context.get(), 0, 1) != 0) fail("response timeout");
}

ModbusReply::~ModbusReply() = default;

std::vector<std::uint8_t> ModbusReply::receive() {
  std::array<std::uint8_t, modbus::max_adu> answer{};
  const ssize_t size = recv(our_end_.get(), answer.data(), answer.size(), MSG_DONTWAIT);
  if (size <= 0) return {};
  return {answer.begin(), answer.begin() + size};
}

std::vector<std::uint8_t> ModbusReply::registers(const Adu& request, const ResultRegisters& block) {
  std::ranges::copy(block, library_->result->tab_input_registers);
  std::ranges::copy(block, library_->result->tab_registers);
  modbus_reply(library_->context.get(), request.bytes.data(), static_cast<int>(request.size),
               library_->result.get());
  return receive();
}

std::vector<std::uint8_t> ModbusReply::registers(const Adu& request, const TargetRegisters& block) {
  std::ranges::copy(block, library_->target->tab_input_registers);
  std::ranges::copy(block, library_->target->tab_registers);
  modbus_reply(library_->context.get(), request.bytes.data(), static_cast<int>(request.size),
               library_->target.get());
  return receive();
}

std::vector<std::uint8_t> ModbusReply::written(const Adu& request) {
  modbus_reply(library_->context.get(), request.bytes.data(), static_cast<int>(request.size),
               library_->command.get());
  return receive();
}

std::vector<std::uint8_t> ModbusReply::exception(const Adu& request, std::uint8_t number) {
  modbus_reply_exception(library_->context.get(), request.bytes.data(), number);
  return receive();
}

}  // namespace zeropose
