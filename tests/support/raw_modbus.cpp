#include "tests/support/raw_modbus.h"

#include <arpa/inet.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sys/socket.h>

#include <array>
#include <cerrno>
#include <cstring>
#include <stdexcept>

namespace zeropose {
namespace {

void put16(Bytes& bytes, std::size_t value) {
  bytes.push_back(static_cast<std::uint8_t>(value >> 8));
  bytes.push_back(static_cast<std::uint8_t>(value & 0xFF));
}

}  // namespace

Bytes adu(std::uint16_t transaction, const Bytes& pdu, std::uint8_t unit) {
  Bytes bytes;
  put16(bytes, transaction);
  put16(bytes, 0);
  put16(bytes, pdu.size() + 1);
  bytes.push_back(unit);
  bytes.insert(bytes.end(), pdu.begin(), pdu.end());
  return bytes;
}

Bytes read_pdu(std::uint8_t function, std::uint16_t first, std::uint16_t count) {
  Bytes pdu{function};
  put16(pdu, first);
  put16(pdu, count);
  return pdu;
}

Bytes write_pdu(std::uint16_t first, std::span<const std::uint16_t> registers) {
  Bytes pdu{16};
  put16(pdu, first);
  put16(pdu, registers.size());
  pdu.push_back(static_cast<std::uint8_t>(2 * registers.size()));
  for (const std::uint16_t value : registers) put16(pdu, value);
  return pdu;
}

Bytes command_pdu(const Command& command) { return write_pdu(command_reg::first, encode_command(command)); }

RawModbus::RawModbus(std::uint16_t port, const std::string& address, const std::string& own_address)
    : socket_(socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
  sockaddr_in name{};
  if (!own_address.empty()) {
    name.sin_family = AF_INET;
    inet_pton(AF_INET, own_address.c_str(), &name.sin_addr);
    if (bind(socket_.get(), reinterpret_cast<const sockaddr*>(&name), sizeof name) != 0)
      throw std::runtime_error(std::string("test client: ") + std::strerror(errno));
  }
  name.sin_family = AF_INET;
  name.sin_port = htons(port);
  inet_pton(AF_INET, address.c_str(), &name.sin_addr);
  const int on = 1;
  setsockopt(socket_.get(), IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
  if (connect(socket_.get(), reinterpret_cast<const sockaddr*>(&name), sizeof name) != 0)
    throw std::runtime_error(std::string("test client: ") + std::strerror(errno));
}

void RawModbus::send(const Bytes& bytes) {
  [[maybe_unused]] const auto sent = ::send(socket_.get(), bytes.data(), bytes.size(), MSG_NOSIGNAL);
}

bool RawModbus::receive_exactly(std::span<std::uint8_t> bytes) {
  while (!bytes.empty()) {
    pollfd ready{socket_.get(), POLLIN, 0};
    if (poll(&ready, 1, 2000) <= 0) return false;
    const ssize_t size = recv(socket_.get(), bytes.data(), bytes.size(), 0);
    if (size <= 0) return false;
    bytes = bytes.subspan(static_cast<std::size_t>(size));
  }
  return true;
}

Bytes RawModbus::receive() {
  Bytes bytes(7);
  if (!receive_exactly(bytes)) return {};
  const std::size_t length = static_cast<std::size_t>(bytes[4] << 8 | bytes[5]);
  if (length < 2 || length > 254) return {};
  bytes.resize(6 + length);
  if (!receive_exactly(std::span(bytes).subspan(7))) return {};
  return bytes;
}

Bytes RawModbus::ask(const Bytes& pdu, std::uint8_t unit) {
  send(adu(++transaction_, pdu, unit));
  const Bytes answer = receive();
  if (answer.size() < 8 || (answer[0] << 8 | answer[1]) != transaction_) return {};
  return {answer.begin() + 7, answer.end()};
}

bool RawModbus::closed_by_peer(std::chrono::milliseconds within) {
  pollfd ready{socket_.get(), POLLIN, 0};
  if (poll(&ready, 1, static_cast<int>(within.count())) <= 0) return false;
  std::uint8_t byte = 0;
  return recv(socket_.get(), &byte, 1, 0) <= 0;
}

std::optional<std::vector<std::uint16_t>> RawModbus::read_registers(std::uint8_t function,
                                                                    std::uint16_t first,
                                                                    std::uint16_t count) {
  const Bytes pdu = ask(read_pdu(function, first, count));
  if (pdu.size() != 2u + 2u * count || pdu[0] != function || pdu[1] != 2u * count) return std::nullopt;
  std::vector<std::uint16_t> registers;
  for (std::size_t i = 2; i < pdu.size(); i += 2)
    registers.push_back(static_cast<std::uint16_t>(pdu[i] << 8 | pdu[i + 1]));
  return registers;
}

ResultBlock RawModbus::block() {
  const auto registers = read_registers();
  if (!registers) throw std::runtime_error("test client: no block");
  const DecodedBlock decoded = decode_result(*registers);
  if (decoded.problem) throw std::runtime_error("test client: " + std::string(name_of(*decoded.problem)));
  return decoded.block;
}

int RawModbus::command(const Command& command) {
  const Bytes pdu = ask(command_pdu(command));
  if (pdu.size() == 2 && pdu[0] == 0x90) return pdu[1];
  return pdu.size() == 5 && pdu[0] == 16 ? 0 : -1;
}

}  // namespace zeropose
