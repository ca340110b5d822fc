#include "protocol/modbus_peer.h"

#include <arpa/inet.h>
#include <modbus.h>
#include <poll.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <stdexcept>

namespace zeropose {
namespace {

using std::chrono::milliseconds;
using Clock = std::chrono::steady_clock;

struct FreeContext {
  void operator()(modbus_t* context) const { modbus_free(context); }
};
using Context = std::unique_ptr<modbus_t, FreeContext>;

void check(const ModbusTcpAddress& where) {
  in_addr parsed{};
  if (inet_pton(AF_INET, where.address.c_str(), &parsed) != 1)
    throw std::invalid_argument("Modbus: \"" + where.address +
                                "\" is no numeric IPv4 address such as 192.168.0.10");
  if (where.port == 0) throw std::invalid_argument("Modbus: port 0 cannot be connected to");
}

const ModbusPeerOptions& checked(const ModbusPeerOptions& options) {
  std::visit([](const auto& where) { check(where); }, options.where);
  const bool tcp = std::holds_alternative<ModbusTcpAddress>(options.where);
  const bool in_range = options.unit >= 1 && options.unit <= 247;
  if (!in_range && !(tcp && (options.unit == 0 || options.unit == 255)))
    throw std::invalid_argument("Modbus: unit " + std::to_string(options.unit) +
                                " is not allowed; 1..247, on TCP also 0 and 255");
  if (options.response_timeout < milliseconds(1) || options.response_timeout > milliseconds(60000))
    throw std::invalid_argument("Modbus: response time-out must be 1..60000 ms");
  return options;
}

Context context_for(const ModbusTcpAddress& where) {
  return Context(modbus_new_tcp(where.address.c_str(), where.port));
}
Context context_for(const SerialLine& line) {
  return Context(modbus_new_rtu(line.device.c_str(), line.baud, line.parity, 8, line.stop_bits));
}

PeerProblem problem_of(int error) {
  switch (error) {
    case ETIMEDOUT:
      return PeerProblem::no_answer;
    case EMBBADCRC:
    case EMBBADDATA:
    case EMBBADEXC:
    case EMBUNKEXC:
    case EMBMDATA:
    case EMBBADSLAVE:
      return PeerProblem::wrong_answer;
    default:
      if (error > MODBUS_ENOBASE && error < EMBBADCRC) return PeerProblem::refused;
      return PeerProblem::connection_lost;
  }
}

// True: nothing came for `silence`. False: the line is never quiet, or gone.
bool wait_for_silence(int device, milliseconds silence) {
  const auto patience = Clock::now() + std::min(4 * silence, milliseconds(1000));
  std::array<char, 256> late{};
  while (Clock::now() < patience) {
    pollfd entry{device, POLLIN, 0};
    const int ready = poll(&entry, 1, static_cast<int>(silence.count()));
    if (ready == 0) return true;
    if (ready < 0 && errno != EINTR) return false;
    if (ready > 0 && ::read(device, late.data(), late.size()) <= 0) return false;
  }
  return false;
}

}  // namespace

std::string_view name_of(PeerProblem problem) {
  switch (problem) {
    case PeerProblem::not_connected:
      return "not connected";
    case PeerProblem::cannot_connect:
      return "cannot connect";
    case PeerProblem::no_answer:
      return "no answer";
    case PeerProblem::connection_lost:
      return "connection lost";
    case PeerProblem::wrong_answer:
      return "wrong answer";
    case PeerProblem::refused:
      return "refused";
  }
  return "unknown";
}

struct ModbusPeer::Session {
  Context context;
  bool connected = false;
  bool answer_may_come = false;  // to a question that was given up
};

ModbusPeer::ModbusPeer(const ModbusPeerOptions& options)
    : options_(checked(options)), session_(std::make_unique<Session>()) {
  session_->context = std::visit([](const auto& where) { return context_for(where); }, options.where);
  modbus_t* const context = session_->context.get();
  if (context == nullptr || modbus_set_slave(context, options.unit) != 0)
    throw std::runtime_error("Modbus: " + name() + ": " + modbus_strerror(errno));
  const auto time = options.response_timeout.count();
  modbus_set_response_timeout(context, static_cast<std::uint32_t>(time / 1000),
                              static_cast<std::uint32_t>(time % 1000 * 1000));
  // Without a time-out per byte the one above is for the whole answer, also when it comes in drops.
  modbus_set_byte_timeout(context, 0, 0);
}

ModbusPeer::ModbusPeer(const std::string& address, std::uint16_t port, std::uint8_t unit,
                       milliseconds response_timeout)
    : ModbusPeer(ModbusPeerOptions{ModbusTcpAddress{address, port}, unit, response_timeout}) {}

ModbusPeer::~ModbusPeer() {
  if (session_) close();
}
ModbusPeer::ModbusPeer(ModbusPeer&&) noexcept = default;
ModbusPeer& ModbusPeer::operator=(ModbusPeer&& other) noexcept {
  std::swap(options_, other.options_);
  std::swap(session_, other.session_);
  return *this;
}

std::string ModbusPeer::name() const {
  const std::string unit = " unit " + std::to_string(options_.unit);
  if (const auto* tcp = std::get_if<ModbusTcpAddress>(&options_.where))
    return tcp->address + " port " + std::to_string(tcp->port) + unit;
  return std::get<SerialLine>(options_.where).device + unit;
}

PeerFailure ModbusPeer::failure(PeerProblem problem, const std::string& what) const {
  return {problem, 0, "Modbus: " + name() + ": " + what};
}

bool ModbusPeer::connected() const { return session_->connected; }

void ModbusPeer::close() {
  if (!session_->connected) return;
  modbus_close(session_->context.get());
  session_->connected = false;
}

std::optional<PeerFailure> ModbusPeer::connect() {
  if (session_->connected) return std::nullopt;
  modbus_t* const context = session_->context.get();
  if (modbus_connect(context) != 0)
    return failure(PeerProblem::cannot_connect, std::string("cannot connect (") + modbus_strerror(errno) +
                                                    "); is the device on, and are the settings its own?");
  session_->connected = true;
  if (std::holds_alternative<ModbusTcpAddress>(options_.where)) return std::nullopt;
  modbus_flush(context);
  if (session_->answer_may_come && !wait_for_silence(modbus_get_socket(context), options_.response_timeout)) {
    close();
    return failure(PeerProblem::cannot_connect,
                   "the line does not become quiet; is another master on it, or another speed set?");
  }
  session_->answer_may_come = false;
  return std::nullopt;
}

PeerFailure ModbusPeer::failure_of_errno() {
  const int error = errno;
  const PeerProblem problem = problem_of(error);
  if (problem == PeerProblem::refused) {
    PeerFailure refused = failure(problem, std::string("refused (") + modbus_strerror(error) + ")");
    refused.exception = static_cast<std::uint8_t>(error - MODBUS_ENOBASE);
    return refused;
  }
  session_->answer_may_come = true;
  close();
  if (problem == PeerProblem::no_answer)
    return failure(problem, "no answer within " + std::to_string(options_.response_timeout.count()) +
                                " ms; is the unit the device's own?");
  return failure(problem, std::string(name_of(problem)) + " (" + modbus_strerror(error) + ")");
}

RegisterAnswer ModbusPeer::read(std::uint16_t first, std::uint16_t count, bool holding) {
  if (!session_->connected) return {failure(PeerProblem::not_connected, "not connected"), {}};
  std::vector<std::uint16_t> registers(count);
  const auto call = holding ? modbus_read_registers : modbus_read_input_registers;
  if (call(session_->context.get(), first, count, registers.data()) != count) return {failure_of_errno(), {}};
  return {std::nullopt, std::move(registers)};
}

RegisterAnswer ModbusPeer::read_input(std::uint16_t first, std::uint16_t count) {
  return read(first, count, false);
}

RegisterAnswer ModbusPeer::read_holding(std::uint16_t first, std::uint16_t count) {
  return read(first, count, true);
}

std::optional<PeerFailure> ModbusPeer::write(std::uint16_t first, std::span<const std::uint16_t> registers) {
  if (!session_->connected) return failure(PeerProblem::not_connected, "not connected");
  const auto count = static_cast<int>(registers.size());
  if (modbus_write_registers(session_->context.get(), first, count, registers.data()) == count)
    return std::nullopt;
  return failure_of_errno();
}

BlockAnswer ModbusPeer::read_block() {
  RegisterAnswer answer = read_input(0, reg::block_size);
  if (answer.failure) return {std::move(answer.failure), {}};
  return {std::nullopt, decode_result(answer.registers, options_.result_data_id)};
}

std::optional<PeerFailure> ModbusPeer::write_command(const Command& command) {
  return write(command_reg::first, encode_command(command, options_.command_data_id));
}

}  // namespace zeropose
