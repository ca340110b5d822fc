#include "protocol/modbus_client_link.h"

#include <poll.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <cstring>
#include <mutex>
#include <stdexcept>
#include <thread>

#include "protocol/command_watch.h"
#include "protocol/controller_blocks.h"
#include "protocol/link_checks.h"
#include "protocol/modbus_framing.h"

namespace zeropose {
namespace {

using std::chrono::milliseconds;
using Clock = std::chrono::steady_clock;

constexpr milliseconds longest_wait{500};
constexpr std::size_t life_size = 4;

void expect(bool allowed, const std::string& what) {
  if (!allowed) throw std::invalid_argument("Modbus client: " + what);
}

void check_range(milliseconds value, int lowest, int highest, const std::string& what) {
  expect(value >= milliseconds(lowest) && value <= milliseconds(highest),
         what + " must be " + std::to_string(lowest) + ".." + std::to_string(highest) + " ms, not " +
             std::to_string(value.count()));
}

void check_addresses(const ModbusClientOptions& options) {
  struct Range {
    const char* name;
    std::size_t first, size;
  };
  const Range ranges[] = {{"command", options.command_address, command_reg::block_size},
                          {"result", options.result_address, reg::block_size},
                          {"life", options.life_address, life_size}};
  for (const Range& a : ranges) {
    expect(a.first + a.size <= 65536,
           std::string(a.name) + " block at " + std::to_string(a.first) + " ends beyond register 65535");
    for (const Range& b : ranges)
      expect(&a == &b || a.first + a.size <= b.first || b.first + b.size <= a.first,
             std::string(a.name) + " and " + b.name + " block overlap (10, 61 and 4 registers)");
  }
}

// What a server would answer with; 0: nothing to complain about.
std::uint16_t exception_of(CommandVerdict verdict) {
  if (verdict == CommandVerdict::accepted) return 0;
  return verdict == CommandVerdict::busy ? modbus::busy : modbus::illegal_data_value;
}

}  // namespace

void check(const ModbusClientOptions& options) {
  check_addresses(options);
  check_range(options.poll_period, 1, 1000, "poll period");
  check_range(options.heartbeat_period, 10, 10000, "heartbeat period");
  check_range(options.response_timeout, 1, 1000, "response time-out");
  check_range(options.first_pause, 1, 60000, "first pause before connecting again");
  check_range(options.longest_pause, static_cast<int>(options.first_pause.count()), 600000,
              "longest pause before connecting again");
  expect(options.max_registers >= command_reg::block_size && options.max_registers <= 123,
         "max registers must be 10..123, not " + std::to_string(options.max_registers));
  expect(options.write_attempts >= 1, "write attempts must be at least 1");
}

class ModbusClientLink::Loop {
 public:
  Loop(const ModbusClientOptions& options, RobotEndpoint& endpoint);
  ~Loop();
  ModbusClientCounters counters() const;
  std::uint64_t rounds() const { return rounds_; }

 private:
  using Counter = ControllerBlocks::Counter;
  struct Shown {
    std::uint32_t epoch;
    std::uint16_t sequence;
  };

  ControllerBlocks::Events events();
  void count(Counter counter);
  void set_connected(bool connected);
  void wake();
  void run();
  void wait_until(TimePoint time);
  TimePoint next_work() const;
  void begin_session();
  bool prepare_session();
  bool serve();
  bool look_for_command();
  bool take_command(const Command& command);
  bool show();
  bool is_shown(const ResultBlock& block) const;
  bool show_life(TimePoint now);
  void end_session();

  const ModbusClientOptions options_;
  RobotEndpoint& endpoint_;
  mutable std::mutex mutex_;  // guards the next one
  ModbusClientCounters counters_;
  std::atomic<std::uint64_t> rounds_{0};
  std::atomic<bool> stopping_{false};
  Descriptor wake_;

  // Of the thread alone.
  ControllerBlocks blocks_;
  CommandWatch watch_;
  std::optional<ConnectionId> session_;
  std::optional<Shown> shown_;
  TimePoint poll_at_{}, life_at_{}, connect_at_{};
  milliseconds pause_;
  std::uint16_t life_ = 0;
  std::uint32_t last_id_ = 0;
  std::uint16_t last_exception_ = 0;

  std::thread thread_;
};

ModbusClientLink::Loop::Loop(const ModbusClientOptions& options, RobotEndpoint& endpoint)
    : options_((check(options), options)),
      endpoint_(endpoint),
      wake_(eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC)),
      blocks_(options_, events()),
      watch_(options.require_command_crc, options.command_data_id),
      pause_(options.first_pause) {
  if (!wake_) throw std::runtime_error(std::string("Modbus client: eventfd: ") + std::strerror(errno));
  endpoint_.on_change([this] { wake(); });
  thread_ = std::thread([this] { run(); });
}

ModbusClientLink::Loop::~Loop() {
  endpoint_.on_change(nullptr);
  stopping_ = true;
  wake();
  thread_.join();
}

ControllerBlocks::Events ModbusClientLink::Loop::events() {
  const auto note = [this](const PeerFailure& failure) {
    const std::scoped_lock lock(mutex_);
    counters_.last_failure = failure.text;
  };
  return {[this](Counter counter) { count(counter); }, [this] { ++rounds_; }, note};
}

void ModbusClientLink::Loop::count(Counter counter) {
  const std::scoped_lock lock(mutex_);
  ++(counters_.*counter);
}

void ModbusClientLink::Loop::set_connected(bool connected) {
  const std::scoped_lock lock(mutex_);
  counters_.connected = connected;
}

ModbusClientCounters ModbusClientLink::Loop::counters() const {
  const std::scoped_lock lock(mutex_);
  return counters_;
}

void ModbusClientLink::Loop::wake() {
  const std::uint64_t one = 1;
  // Fails only when the counter is full, and then the loop is awake already.
  [[maybe_unused]] const auto written = write(wake_.get(), &one, sizeof one);
}

void ModbusClientLink::Loop::run() {
  while (!stopping_) {
    ++rounds_;
    endpoint_.tick();
    if (!session_ && Clock::now() >= connect_at_) begin_session();
    if (session_ && !serve()) end_session();
    if (!stopping_) wait_until(next_work());
  }
  if (!session_) return;
  // A controller that is left with a valid result would believe it until it misses the sign of life.
  endpoint_.disconnected(*session_);
  show();
  end_session();
}

TimePoint ModbusClientLink::Loop::next_work() const {
  TimePoint until = Clock::now() + longest_wait;
  if (const auto next = endpoint_.next_event()) until = std::min(until, *next);
  return std::min(until, session_ ? std::min(poll_at_, life_at_) : connect_at_);
}

void ModbusClientLink::Loop::wait_until(TimePoint time) {
  const auto left = std::max(milliseconds(0), std::chrono::ceil<milliseconds>(time - Clock::now()));
  pollfd entry{wake_.get(), POLLIN, 0};
  if (poll(&entry, 1, static_cast<int>(left.count())) <= 0) return;
  std::uint64_t value = 0;
  [[maybe_unused]] const auto size = read(wake_.get(), &value, sizeof value);
}

void ModbusClientLink::Loop::begin_session() {
  if (blocks_.connect()) {
    count(&ModbusClientCounters::connections);
    session_ = endpoint_.new_connection();
    if (prepare_session()) {
      pause_ = options_.first_pause;
      return set_connected(true);
    }
  }
  end_session();
}

// No command before the controller has shown that it stores what the house writes.
bool ModbusClientLink::Loop::prepare_session() {
  const auto first_look = blocks_.read_command();
  if (!first_look) return false;
  watch_.start(*first_look);
  last_id_ = request_id_of(*first_look);
  last_exception_ = modbus::illegal_data_value;
  poll_at_ = Clock::now() + options_.poll_period;
  return show() && show_life(Clock::now());
}

void ModbusClientLink::Loop::end_session() {
  blocks_.close();
  if (session_) endpoint_.disconnected(*session_);
  session_.reset();
  shown_.reset();
  set_connected(false);
  connect_at_ = Clock::now() + pause_;
  pause_ = std::min(2 * pause_, options_.longest_pause);
}

// False: the session is over.
bool ModbusClientLink::Loop::serve() {
  if (Clock::now() >= poll_at_) {
    poll_at_ = Clock::now() + options_.poll_period;
    if (!look_for_command()) return false;
  }
  const TimePoint now = Clock::now();
  if (now < life_at_ && is_shown(endpoint_.block())) return true;
  return show() && (now < life_at_ || show_life(now));
}

bool ModbusClientLink::Loop::look_for_command() {
  const auto registers = blocks_.read_command();
  if (!registers) return false;
  count(&ModbusClientCounters::polls);
  switch (watch_.look(*registers)) {
    case CommandWatch::Sight::nothing:
      return true;
    case CommandWatch::Sight::wrong_crc:
      count(&ModbusClientCounters::wrong_crc);
      last_id_ = request_id_of(*registers);
      last_exception_ = modbus::illegal_data_value;
      return show_life(Clock::now());
    case CommandWatch::Sight::command:
      return take_command(watch_.command());
  }
  return false;
}

bool ModbusClientLink::Loop::take_command(const Command& command) {
  const CommandVerdict verdict = endpoint_.command(command, *session_);
  const bool accepted = verdict == CommandVerdict::accepted;
  count(accepted ? &ModbusClientCounters::commands : &ModbusClientCounters::refused_commands);
  last_id_ = command.request_id;
  last_exception_ = exception_of(verdict);
  // First the block: who sees that the command was accepted must not see the answer to the last one.
  return show() && show_life(Clock::now());
}

bool ModbusClientLink::Loop::is_shown(const ResultBlock& block) const {
  return shown_ && shown_->epoch == block.epoch && shown_->sequence == block.sequence;
}

bool ModbusClientLink::Loop::show() {
  for (int attempt = 0; attempt < options_.write_attempts && blocks_.connected(); ++attempt) {
    const ResultBlock block = endpoint_.block();
    if (!blocks_.store(encode(block, options_.result_data_id))) continue;
    shown_ = Shown{block.epoch, block.sequence};
    return true;
  }
  if (blocks_.connected()) count(&ModbusClientCounters::dropped_unwritable);
  return false;
}

bool ModbusClientLink::Loop::show_life(TimePoint now) {
  life_at_ = now + options_.heartbeat_period;
  return blocks_.write_life(++life_, last_id_, last_exception_);
}

ModbusClientLink::ModbusClientLink(const ModbusClientOptions& options, RobotEndpoint& endpoint)
    : loop_(std::make_unique<Loop>(options, endpoint)) {}
ModbusClientLink::~ModbusClientLink() = default;
ModbusClientCounters ModbusClientLink::counters() const { return loop_->counters(); }
std::uint64_t ModbusClientLink::rounds() const { return loop_->rounds(); }

std::string ModbusClientLink::problem() const {
  const ModbusClientCounters now = counters();
  return now.connected ? std::string() : now.last_failure;
}

}  // namespace zeropose
