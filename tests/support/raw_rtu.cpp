#include "tests/support/raw_rtu.h"

#include <fcntl.h>
#include <poll.h>
#include <stdlib.h>
#include <termios.h>
#include <unistd.h>

#include <array>
#include <stdexcept>

namespace zeropose {
namespace {

using Clock = std::chrono::steady_clock;

// As the book has it, one bit after the other.
std::uint16_t crc16(const Bytes& bytes) {
  unsigned crc = 0xFFFF;
  for (const std::uint8_t byte : bytes)
    for (unsigned bit = 0; bit < 8; ++bit) {
      const bool carry = ((crc ^ static_cast<unsigned>(byte >> bit)) & 1) != 0;
      crc >>= 1;
      if (carry) crc ^= 0xA001;
    }
  return static_cast<std::uint16_t>(crc);
}

}  // namespace

Bytes rtu_frame(const Bytes& pdu, std::uint8_t unit) {
  Bytes frame;
  frame.reserve(pdu.size() + 3);
  frame.push_back(unit);
  frame.insert(frame.end(), pdu.begin(), pdu.end());
  const std::uint16_t crc = crc16(frame);
  frame.push_back(static_cast<std::uint8_t>(crc & 0xFF));
  frame.push_back(static_cast<std::uint8_t>(crc >> 8));
  return frame;
}

RawRtu::RawRtu() {
  std::string name = (std::filesystem::temp_directory_path() / "zeropose-rtu-XXXXXX").string();
  if (mkdtemp(name.data()) == nullptr) throw std::runtime_error("test line: mkdtemp");
  directory_ = name;
  link_ = directory_ / "line";
  plug_in();
}

RawRtu::~RawRtu() { std::filesystem::remove_all(directory_); }

void RawRtu::unplug() {
  std::filesystem::remove(link_);
  line_ = Descriptor();
}

void RawRtu::plug_in() {
  line_ = Descriptor(posix_openpt(O_RDWR | O_NOCTTY | O_CLOEXEC));
  std::array<char, 128> name{};
  if (!line_ || grantpt(line_.get()) != 0 || unlockpt(line_.get()) != 0 ||
      ptsname_r(line_.get(), name.data(), name.size()) != 0)
    throw std::runtime_error("test line: no pseudo terminal");
  termios raw{};
  tcgetattr(line_.get(), &raw);
  cfmakeraw(&raw);
  tcsetattr(line_.get(), TCSANOW, &raw);
  std::filesystem::create_symlink(name.data(), link_);
}

void RawRtu::send(const Bytes& bytes) {
  if (::write(line_.get(), bytes.data(), bytes.size()) != static_cast<ssize_t>(bytes.size()))
    throw std::runtime_error("test line: write");
}

bool RawRtu::nothing_to_read() const {
  pollfd entry{line_.get(), POLLIN, 0};
  return poll(&entry, 1, 0) == 0;
}

bool RawRtu::receive_exactly(Bytes& bytes, std::size_t count, Clock::time_point deadline) {
  while (bytes.size() < count) {
    const auto left = std::chrono::ceil<std::chrono::milliseconds>(deadline - Clock::now());
    pollfd entry{line_.get(), POLLIN, 0};
    if (left.count() <= 0 || poll(&entry, 1, static_cast<int>(left.count())) <= 0) return false;
    std::array<std::uint8_t, 300> part{};
    const ssize_t size = ::read(line_.get(), part.data(), count - bytes.size());
    if (size <= 0) return false;
    bytes.insert(bytes.end(), part.begin(), part.begin() + size);
  }
  return true;
}

Bytes RawRtu::receive(std::chrono::milliseconds patience) {
  const auto deadline = Clock::now() + patience;
  Bytes bytes;
  if (!receive_exactly(bytes, 3, deadline)) return {};
  const std::size_t size = (bytes[1] & 0x80) != 0 ? 5 : bytes[1] == 16 ? 8 : std::size_t{5} + bytes[2];
  return receive_exactly(bytes, size, deadline) ? bytes : Bytes{};
}

Bytes RawRtu::receive_bytes(std::size_t count, std::chrono::milliseconds patience) {
  Bytes bytes;
  return receive_exactly(bytes, count, Clock::now() + patience) ? bytes : Bytes{};
}

Bytes RawRtu::ask(const Bytes& pdu, std::uint8_t unit) {
  send(rtu_frame(pdu, unit));
  const Bytes answer = receive();
  if (answer.size() < 5 || answer[0] != unit) return {};
  const Bytes body(answer.begin() + 1, answer.end() - 2);
  return rtu_frame(body, unit) == answer ? body : Bytes{};
}

ResultBlock RawRtu::block() {
  const Bytes pdu = ask(read_pdu(4, 0, reg::block_size));
  if (pdu.size() != 2 + 2 * reg::block_size) throw std::runtime_error("test line: no block");
  std::vector<std::uint16_t> registers;
  for (std::size_t i = 2; i < pdu.size(); i += 2)
    registers.push_back(static_cast<std::uint16_t>(pdu[i] << 8 | pdu[i + 1]));
  const DecodedBlock decoded = decode_result(registers);
  if (decoded.problem) throw std::runtime_error(std::string(name_of(*decoded.problem)));
  return decoded.block;
}

int RawRtu::command(const Command& command) {
  const Bytes answer = ask(command_pdu(command));
  if (answer.empty()) return -1;
  return answer[0] == 16 ? 0 : answer[1];
}

}  // namespace zeropose
