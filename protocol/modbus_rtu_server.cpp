#include "protocol/modbus_rtu_server.h"

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

#include "protocol/link_checks.h"
#include "protocol/modbus_reply.h"
#include "protocol/rtu_framing.h"

namespace zeropose {
namespace {

using std::chrono::milliseconds;
using Clock = std::chrono::steady_clock;
using Counter = std::uint64_t ModbusRtuCounters::*;

// Also how finely it is known when a byte came.
constexpr milliseconds longest_wait{100};

void check_range(milliseconds value, int lowest, int highest, const char* what) {
  if (value < milliseconds(lowest) || value > milliseconds(highest))
    throw std::invalid_argument(std::string("Modbus RTU: ") + what + " must be " + std::to_string(lowest) +
                                ".." + std::to_string(highest) + " ms, not " + std::to_string(value.count()));
}

Counter counter_of(RtuProblem problem) {
  switch (problem) {
    case RtuProblem::wrong_length:
      return &ModbusRtuCounters::wrong_length;
    case RtuProblem::wrong_crc:
      return &ModbusRtuCounters::wrong_crc;
    case RtuProblem::broadcast:
      return &ModbusRtuCounters::broadcasts;
    case RtuProblem::other_unit:
      return &ModbusRtuCounters::other_units;
    case RtuProblem::wrong_pdu:
      break;
  }
  return &ModbusRtuCounters::wrong_pdu;
}

}  // namespace

void check(const ModbusRtuOptions& options) {
  check(options.line);
  if (options.unit.unit < 1 || options.unit.unit > 247)
    throw std::invalid_argument("Modbus RTU: unit must be 1..247, not " + std::to_string(options.unit.unit));
  check_range(options.answer_within, 10, 10000, "the time for an answer");
  check_range(options.master_timeout, 100, 600000, "the master's time-out");
  check_range(options.gap_tolerance, 0, 100, "the gap tolerance");
  check_range(options.first_pause, 1, 60000, "the first pause before opening again");
  check_range(options.longest_pause, static_cast<int>(options.first_pause.count()), 600000,
              "the longest pause before opening again");
}

class ModbusRtuServer::Loop {
 public:
  Loop(const ModbusRtuOptions& options, RobotEndpoint& endpoint);
  ~Loop();
  ModbusRtuCounters counters() const;
  std::uint64_t rounds() const { return rounds_; }

 private:
  void count(Counter counter);
  void wake();
  void run();
  void wait_and_serve();
  TimePoint next_work(TimePoint now) const;
  void open_device();
  void lose_device(const std::string& why);
  void new_master();
  void read_bytes();
  void serve_frame();
  bool is_late() const;
  std::vector<std::uint8_t> answer(const Adu& request);
  void send(const std::vector<std::uint8_t>& answer);

  const ModbusRtuOptions options_;
  RobotEndpoint& endpoint_;
  const ModbusUnitServer unit_;
  mutable std::mutex mutex_;  // guards the next one
  ModbusRtuCounters counters_;
  std::atomic<std::uint64_t> rounds_{0};
  std::atomic<bool> stopping_{false};
  Descriptor wake_;

  // Of the thread alone.
  ModbusReply reply_;
  RtuReader reader_;
  Descriptor device_;
  ConnectionId master_ = 0;
  // Nothing was waiting to be read then: what is read later has come later. Tells how old a request can be
  // even when this process was stopped for a while.
  TimePoint known_empty_{};
  TimePoint came_after_{};  // the last byte of the frame
  TimePoint last_request_{}, open_at_{};
  milliseconds pause_;

  std::thread thread_;
};

ModbusRtuServer::Loop::Loop(const ModbusRtuOptions& options, RobotEndpoint& endpoint)
    : options_((check(options), options)),
      endpoint_(endpoint),
      unit_(options.unit, endpoint),
      wake_(eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC)),
      reader_(options.unit.unit, frame_silence(options.line), options.gap_tolerance),
      pause_(options.first_pause) {
  if (!wake_) throw std::runtime_error(std::string("Modbus RTU: eventfd: ") + std::strerror(errno));
  endpoint_.on_change([this] { wake(); });
  thread_ = std::thread([this] { run(); });
}

ModbusRtuServer::Loop::~Loop() {
  endpoint_.on_change(nullptr);
  stopping_ = true;
  wake();
  thread_.join();
}

void ModbusRtuServer::Loop::count(Counter counter) {
  const std::scoped_lock lock(mutex_);
  ++(counters_.*counter);
}

ModbusRtuCounters ModbusRtuServer::Loop::counters() const {
  const std::scoped_lock lock(mutex_);
  return counters_;
}

void ModbusRtuServer::Loop::wake() {
  const std::uint64_t one = 1;
  // Fails only when the counter is full, and then the loop is awake already.
  [[maybe_unused]] const auto written = write(wake_.get(), &one, sizeof one);
}

void ModbusRtuServer::Loop::run() {
  while (!stopping_) {
    ++rounds_;
    endpoint_.tick();
    if (!device_ && Clock::now() >= open_at_) open_device();
    wait_and_serve();
  }
  if (device_) endpoint_.disconnected(master_);
}

void ModbusRtuServer::Loop::open_device() {
  try {
    device_ = open_line(options_.line);
  } catch (const std::runtime_error& error) {
    count(&ModbusRtuCounters::cannot_open);
    return lose_device(error.what());
  }
  count(&ModbusRtuCounters::opened);
  master_ = endpoint_.new_connection();
  reader_.clear();
  known_empty_ = last_request_ = Clock::now();
  const std::scoped_lock lock(mutex_);
  counters_.open = true;
}

void ModbusRtuServer::Loop::lose_device(const std::string& why) {
  if (device_) {
    count(&ModbusRtuCounters::lost);
    endpoint_.disconnected(master_);
  }
  device_ = Descriptor();
  open_at_ = Clock::now() + pause_;
  pause_ = std::min(2 * pause_, options_.longest_pause);
  const std::scoped_lock lock(mutex_);
  counters_.open = false;
  counters_.last_failure = why;
}

void ModbusRtuServer::Loop::new_master() {
  if (endpoint_.owner() == master_) {
    count(&ModbusRtuCounters::masters_lost);
    endpoint_.disconnected(master_);
    master_ = endpoint_.new_connection();
  }
  last_request_ = Clock::now();
}

TimePoint ModbusRtuServer::Loop::next_work(TimePoint now) const {
  TimePoint until = now + longest_wait;
  if (const auto next = endpoint_.next_event()) until = std::min(until, *next);
  if (!device_) return std::min(until, open_at_);
  if (const auto end = reader_.frame_end()) until = std::min(until, *end);
  return std::min(until, last_request_ + options_.master_timeout);
}

void ModbusRtuServer::Loop::wait_and_serve() {
  const TimePoint now = Clock::now();
  const auto left = std::max(std::chrono::nanoseconds(0),
                             std::chrono::duration_cast<std::chrono::nanoseconds>(next_work(now) - now));
  const timespec time{0, static_cast<long>(left.count())};  // below a second
  pollfd entries[] = {{wake_.get(), POLLIN, 0}, {device_.get(), POLLIN, 0}};
  ppoll(entries, 2, &time, nullptr);
  if (entries[0].revents != 0) {
    std::uint64_t value = 0;
    [[maybe_unused]] const auto size = read(wake_.get(), &value, sizeof value);
  }
  if (!device_) return;
  read_bytes();
  if (device_) serve_frame();
  if (device_ && Clock::now() >= last_request_ + options_.master_timeout) new_master();
}

// Looks whether the poll said so or not: only a look in vain tells that nothing was waiting.
void ModbusRtuServer::Loop::read_bytes() {
  std::array<std::uint8_t, 512> bytes{};
  for (;;) {
    const ssize_t size = read(device_.get(), bytes.data(), bytes.size());
    const TimePoint now = Clock::now();
    if (size > 0) {
      reader_.feed(std::span(bytes).first(static_cast<std::size_t>(size)), now);
      came_after_ = known_empty_;
    } else if (size < 0 && errno == EAGAIN) {
      known_empty_ = now;
      return;
    } else if (size == 0 || errno != EINTR) {
      return lose_device(options_.line.device +
                         ": the device is gone: " + std::strerror(size < 0 ? errno : EIO));
    }
  }
}

bool ModbusRtuServer::Loop::is_late() const { return Clock::now() > came_after_ + options_.answer_within; }

void ModbusRtuServer::Loop::serve_frame() {
  const auto frame = reader_.take(Clock::now());
  if (!frame) return;
  if (frame->problem) return count(counter_of(*frame->problem));
  pause_ = options_.first_pause;
  last_request_ = Clock::now();
  // A late command is not carried out either.
  if (is_late()) return count(&ModbusRtuCounters::late);
  const auto reply = answer(frame->request);
  if (reply.size() <= modbus::header) return;
  send(encode_rtu(reply));
}

void ModbusRtuServer::Loop::send(const std::vector<std::uint8_t>& answer) {
  if (is_late()) return count(&ModbusRtuCounters::late);
  pollfd entry{device_.get(), POLLIN, 0};
  if (poll(&entry, 1, 0) > 0 && (entry.revents & POLLIN) != 0) return count(&ModbusRtuCounters::overtaken);
  count(&ModbusRtuCounters::answers);  // first: who has the answer finds it counted
  const ssize_t size = write(device_.get(), answer.data(), answer.size());
  if (size == static_cast<ssize_t>(answer.size())) return;
  // The rest of an answer, sent later, would look like another one.
  lose_device(options_.line.device +
              ": the device takes no answer: " + std::strerror(size < 0 ? errno : EIO));
}

std::vector<std::uint8_t> ModbusRtuServer::Loop::answer(const Adu& request) {
  const std::scoped_lock lock(mutex_);
  return unit_.answer(request, master_, true, reply_, counters_);
}

ModbusRtuServer::ModbusRtuServer(const ModbusRtuOptions& options, RobotEndpoint& endpoint)
    : loop_(std::make_unique<Loop>(options, endpoint)) {}
ModbusRtuServer::~ModbusRtuServer() = default;
ModbusRtuCounters ModbusRtuServer::counters() const { return loop_->counters(); }
std::uint64_t ModbusRtuServer::rounds() const { return loop_->rounds(); }
std::string ModbusRtuServer::problem() const {
  const ModbusRtuCounters now = counters();
  return now.open ? std::string() : now.last_failure;
}

}  // namespace zeropose
