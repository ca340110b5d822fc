#include "protocol/can_link.h"

#include <poll.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cerrno>
#include <cstring>
#include <mutex>
#include <stdexcept>
#include <thread>

#include "protocol/can_socket.h"

namespace zeropose {
namespace {

using Clock = std::chrono::steady_clock;
using std::chrono::milliseconds;

constexpr milliseconds longest_wait{500}, first_pause{50}, longest_pause{2000}, last_words{50};
constexpr int frames_per_round = 64;

std::string fault_text(CanFault fault, const std::string& interface) {
  switch (fault) {
    case CanFault::none:
      return {};
    case CanFault::bus_off:
      return "CAN " + interface +
             ": the controller was switched off the bus; check cable, termination and bit rate, let it "
             "come " +
             "back (ip link set " + interface + " type can restart-ms 100), then Reset";
    default:
      return "CAN " + interface +
             ": another device sends with this node's identifiers; give it another node id, then Reset";
  }
}

}  // namespace

class CanLink::Loop {
 private:
  template <class Value>
  Value copy(Value Loop::*member) const {
    const std::scoped_lock lock(mutex_);
    return this->*member;
  }

 public:
  Loop(const CanOptions& options, RobotEndpoint& endpoint);
  ~Loop();

  CanCounters counters() const { return copy(&Loop::counters_); }
  CanFault fault() const { return copy(&Loop::fault_); }
  std::string problem() const { return copy(&Loop::problem_); }

 private:
  void wake();
  void run();
  void round();
  void wait(TimePoint now);
  void open(TimePoint now);
  void close(TimePoint now);
  void receive(CanSocket& socket, TimePoint now);
  void handle(const CanReceived& received);
  void send(CanSocket& socket);
  void lose_owner();
  void tell();

  const CanOptions options_;
  RobotEndpoint& endpoint_;

  // Of the loop's thread alone.
  CanNode node_;
  ConnectionId connection_;
  std::optional<CanSocket> socket_;
  TimePoint open_again_at_;
  milliseconds pause_ = first_pause;
  std::string why_closed_;
  std::uint64_t rounds_ = 0;

  mutable std::mutex mutex_;  // guards the next three
  CanCounters counters_;
  CanFault fault_ = CanFault::none;
  std::string problem_ = "not yet opened";

  Descriptor wake_;
  std::atomic<bool> stopping_{false};
  std::thread thread_;
};

CanLink::Loop::Loop(const CanOptions& options, RobotEndpoint& endpoint)
    : options_(options),
      endpoint_(endpoint),
      node_(options, endpoint.options().convention),
      connection_(endpoint.new_connection()),
      wake_(eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC)) {
  if (!wake_) throw std::runtime_error(std::string("CAN: eventfd: ") + std::strerror(errno));
  endpoint_.on_change([this] { wake(); });
  thread_ = std::thread([this] { run(); });
}

CanLink::Loop::~Loop() {
  endpoint_.on_change(nullptr);
  stopping_ = true;
  wake();
  thread_.join();
}

void CanLink::Loop::wake() {
  const std::uint64_t one = 1;
  // Fails only when the counter is full, and then the loop is awake already.
  [[maybe_unused]] const auto written = write(wake_.get(), &one, sizeof one);
}

void CanLink::Loop::run() {
  while (!stopping_) round();
  // The bus is told that there is no result any more, if it takes frames.
  endpoint_.disconnected(connection_);
  const TimePoint end = Clock::now() + last_words;
  while (socket_ && Clock::now() < end) round();
}

void CanLink::Loop::round() {
  const TimePoint begin = Clock::now();
  if (!socket_ && begin >= open_again_at_) open(begin);
  wait(begin);
  const TimePoint now = Clock::now();
  if (socket_) receive(*socket_, now);
  endpoint_.tick();
  node_.tick(now);
  node_.show(endpoint_.block());
  if (socket_) send(*socket_);
  ++rounds_;
  tell();
}

void CanLink::Loop::wait(TimePoint now) {
  TimePoint until = now + longest_wait;
  if (!socket_) until = std::min(until, open_again_at_);
  if (const auto next = node_.next_event()) until = std::min(until, *next);
  if (const auto next = endpoint_.next_event()) until = std::min(until, *next);
  const auto time = std::max(milliseconds(0), std::chrono::ceil<milliseconds>(until - now));
  std::array<pollfd, 2> watched{
      {{wake_.get(), POLLIN, 0}, {socket_ ? socket_->descriptor() : -1, POLLIN, 0}}};
  if (poll(watched.data(), watched.size(), static_cast<int>(time.count())) <= 0) return;
  std::uint64_t value = 0;
  if (watched[0].revents) [[maybe_unused]]
    const auto size = read(wake_.get(), &value, sizeof value);
}

void CanLink::Loop::open(TimePoint now) {
  try {
    socket_.emplace(options_.interface, static_cast<std::uint32_t>(options_.node), options_.fd);
  } catch (const std::runtime_error& error) {
    why_closed_ = error.what();
    open_again_at_ = now + pause_;
    pause_ = std::min(2 * pause_, longest_pause);
    return;
  }
  why_closed_.clear();
  pause_ = first_pause;
  node_.link_up(now);
}

// What the kernel still holds goes down with the interface.
void CanLink::Loop::close(TimePoint now) {
  socket_.reset();
  why_closed_ = "CAN " + options_.interface + ": the interface went down";
  open_again_at_ = now;
  node_.link_down();
  lose_owner();
}

void CanLink::Loop::receive(CanSocket& socket, TimePoint now) {
  CanReceived received;
  for (int i = 0; i < frames_per_round; ++i) {
    const CanIo io = socket.receive(received);
    if (io == CanIo::interface_gone) return close(now);
    if (io != CanIo::done) return;
    handle(received);
  }
}

void CanLink::Loop::handle(const CanReceived& received) {
  const TimePoint now = Clock::now();
  node_.show(endpoint_.block());  // what is read by SDO is of now
  const CanTaken taken = node_.take(received.frame, received.own_echo, now);
  if (taken.command) node_.answered(*taken.command, endpoint_.command(*taken.command, connection_));
  if (taken.link_lost) lose_owner();
}

void CanLink::Loop::send(CanSocket& socket) {
  while (const auto frame = node_.next_frame(Clock::now())) {
    const CanIo io = socket.send(*frame);
    if (io == CanIo::done) continue;
    if (io == CanIo::interface_gone) return close(Clock::now());
    return node_.failed_to_write(Clock::now());
  }
}

// The result is withdrawn and there is a new session epoch.
void CanLink::Loop::lose_owner() {
  endpoint_.disconnected(connection_);
  connection_ = endpoint_.new_connection();
}

void CanLink::Loop::tell() {
  const std::scoped_lock lock(mutex_);
  counters_ = node_.counters();
  counters_.rounds = rounds_;
  fault_ = node_.fault();
  problem_ = why_closed_.empty() ? fault_text(fault_, options_.interface) : why_closed_;
}

CanLink::CanLink(const CanOptions& options, RobotEndpoint& endpoint)
    : loop_(std::make_unique<Loop>(options, endpoint)) {}

CanLink::~CanLink() = default;

CanCounters CanLink::counters() const { return loop_->counters(); }
std::uint64_t CanLink::rounds() const { return loop_->counters().rounds; }
CanFault CanLink::fault() const { return loop_->fault(); }
std::string CanLink::problem() const { return loop_->problem(); }

}  // namespace zeropose
