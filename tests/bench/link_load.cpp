#include "tests/bench/link_load.h"

#include <sys/socket.h>

#include <array>
#include <cerrno>

namespace zeropose {
namespace {

using std::chrono::milliseconds;

const Bytes& read_request() {
  static const Bytes request = adu(1, read_pdu(4, 0, reg::block_size));
  return request;
}

// Without the minute in which the port would stay taken.
void reset_on_close(const RawModbus& client) {
  const linger at_once{1, 0};
  ::setsockopt(client.descriptor(), SOL_SOCKET, SO_LINGER, &at_once, sizeof at_once);
}

}  // namespace

IdleClients::IdleClients(std::uint16_t port, std::size_t count) {
  for (std::size_t i = 0; i < count; ++i) clients_.emplace_back(port);
}

bool IdleClients::drain(const RawModbus& client) {
  constexpr std::size_t answer_size = 9 + 2 * reg::block_size;
  std::array<std::uint8_t, 16 * answer_size> bytes{};
  const ssize_t size = ::recv(client.descriptor(), bytes.data(), bytes.size(), MSG_DONTWAIT);
  if (size > 0) answers += static_cast<std::size_t>(size) / answer_size;
  return size > 0 || (size < 0 && errno == EAGAIN);
}

void ReadingClients::step(std::uint64_t millisecond) {
  for (std::size_t i = millisecond % 10; i < clients_.size(); i += 10) {
    drain(clients_[i]);
    clients_[i].send(read_request());
  }
}

void SlowClients::step(std::uint64_t millisecond) {
  if (millisecond % 400 != 0) return;
  const Bytes whole = adu(1, command_pdu({5, 1, 1, 0, 0}));
  for (RawModbus& client : clients_) {
    if (!drain(client)) {
      client = RawModbus(port_);
      ++connections;
    }
    client.send({whole[sent_]});
  }
  // All have been closed, a second after the first byte, when it is time for the fourth.
  sent_ = (sent_ + 1) % 3;
}

void Flood::step(std::uint64_t millisecond) {
  for (RawModbus& client : clients_) {
    drain(client);
    client.send(read_request());
  }
  RawModbus passing(port_);
  ++connections;
  reset_on_close(passing);
  if (millisecond % 2 == 0) passing.send(read_request());
}

PlayedLoad::PlayedLoad(Load& load)
    : thread_([this, &load] {
        for (std::uint64_t step = 0; !stop_; ++step) {
          std::this_thread::sleep_until(start_ + step * milliseconds(1));
          load.step(step);
        }
      }) {}

PlayedLoad::~PlayedLoad() {
  stop_ = true;
  thread_.join();
}

double PlayedLoad::seconds() const {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count();
}

}  // namespace zeropose
