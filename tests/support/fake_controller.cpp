#include "tests/support/fake_controller.h"

#include <arpa/inet.h>
#include <poll.h>
#include <sys/socket.h>

#include <algorithm>
#include <stdexcept>

namespace zeropose {
namespace {

std::size_t word(const Bytes& bytes, std::size_t at) {
  return static_cast<std::size_t>(bytes[at] << 8 | bytes[at + 1]);
}

void put16(Bytes& bytes, std::size_t value) {
  bytes.push_back(static_cast<std::uint8_t>(value >> 8));
  bytes.push_back(static_cast<std::uint8_t>(value & 0xFF));
}

}  // namespace

FakeController::FakeController() { start(); }
FakeController::~FakeController() { stop(); }

void FakeController::start() {
  listener_ = Descriptor(socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0));
  const int on = 1;
  setsockopt(listener_.get(), SOL_SOCKET, SO_REUSEADDR, &on, sizeof on);
  sockaddr_in name{};
  name.sin_family = AF_INET;
  name.sin_port = htons(port_);
  name.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  socklen_t size = sizeof name;
  if (bind(listener_.get(), reinterpret_cast<const sockaddr*>(&name), size) != 0 ||
      listen(listener_.get(), 8) != 0)
    throw std::runtime_error("fake controller: cannot listen");
  getsockname(listener_.get(), reinterpret_cast<sockaddr*>(&name), &size);
  port_ = ntohs(name.sin_port);
  stopping_ = false;
  thread_ = std::thread([this] { serve(); });
}

void FakeController::stop() {
  stopping_ = true;
  if (thread_.joinable()) thread_.join();
  listener_ = Descriptor();
}

void FakeController::fail(const Faults& faults) {
  const std::scoped_lock lock(mutex_);
  faults_ = faults;
}

void FakeController::set(std::size_t address, std::span<const std::uint16_t> values) {
  const std::scoped_lock lock(mutex_);
  std::ranges::copy(values, registers_.begin() + static_cast<std::ptrdiff_t>(address));
}

std::vector<std::uint16_t> FakeController::get(std::size_t address, std::size_t count) const {
  const std::scoped_lock lock(mutex_);
  const auto first = registers_.begin() + static_cast<std::ptrdiff_t>(address);
  return {first, first + static_cast<std::ptrdiff_t>(count)};
}

void FakeController::after_write(std::function<void()> look) {
  const std::scoped_lock lock(mutex_);
  look_ = std::move(look);
}

bool FakeController::wait_readable(int fd) const {
  while (!stopping_) {
    pollfd entry{fd, POLLIN, 0};
    if (poll(&entry, 1, 5) > 0) return true;
  }
  return false;
}

void FakeController::serve() {
  while (wait_readable(listener_.get())) {
    const Descriptor client(accept4(listener_.get(), nullptr, nullptr, SOCK_CLOEXEC));
    ++connections_;
    serve_client(client.get());
  }
}

void FakeController::serve_client(int client) {
  Bytes buffer;
  while (wait_readable(client)) {
    std::array<std::uint8_t, 512> bytes{};
    const ssize_t size = recv(client, bytes.data(), bytes.size(), 0);
    if (size <= 0) return;
    buffer.insert(buffer.end(), bytes.begin(), bytes.begin() + size);
    while (buffer.size() >= 8 && buffer.size() >= 6 + word(buffer, 4)) {
      const auto end = buffer.begin() + static_cast<std::ptrdiff_t>(6 + word(buffer, 4));
      const Bytes reply = answer(Bytes(buffer.begin(), end));
      buffer.erase(buffer.begin(), end);
      if (!reply.empty()) ::send(client, reply.data(), reply.size(), MSG_NOSIGNAL);
    }
  }
}

Bytes FakeController::answer(const Bytes& request) {
  Faults faults;
  {
    const std::scoped_lock lock(mutex_);
    faults = faults_;
  }
  const Bytes pdu = pdu_for(Bytes(request.begin() + 7, request.end()));
  std::this_thread::sleep_for(faults.answer_delay);
  if (faults.silent) return {};
  const auto transaction = static_cast<std::uint16_t>(word(request, 0) + (faults.wrong_transaction ? 1 : 0));
  return adu(transaction, pdu, request[6]);
}

Bytes FakeController::pdu_for(const Bytes& pdu) {
  std::unique_lock lock(mutex_);
  const auto refuse = [&](std::uint8_t number) {
    return Bytes{static_cast<std::uint8_t>(pdu[0] | 0x80), number};
  };
  const std::size_t first = word(pdu, 1), count = word(pdu, 3);
  if (count > faults_.max_registers) return refuse(3);
  if (pdu[0] == 3 || pdu[0] == 4) {
    if (faults_.refuses_reads) return refuse(2);
    Bytes reply{pdu[0], static_cast<std::uint8_t>(2 * count)};
    for (std::size_t i = 0; i < count; ++i) put16(reply, registers_[first + i]);
    return reply;
  }
  if (pdu[0] != 16) return refuse(1);
  if (faults_.refuses_writes) return refuse(2);
  for (std::size_t i = 0; i < count; ++i) {
    const auto value = static_cast<std::uint16_t>(word(pdu, 6 + 2 * i));
    registers_[first + i] = faults_.store ? faults_.store(first + i, value) : value;
  }
  const auto look = look_;
  lock.unlock();
  if (look) look();
  return {pdu.begin(), pdu.begin() + 5};
}

}  // namespace zeropose
