// zeroposed: the daemon. Wiring only: config, cameras, cycle, robot links, control socket, systemd.
#include <signal.h>
#include <spdlog/sinks/stdout_color_sinks.h>
#include <spdlog/spdlog.h>
#include <time.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <iostream>

#include "config/cell.h"
#include "daemon/control.h"
#include "daemon/cycle.h"
#include "daemon/notify.h"
#include "daemon/version.h"
#include "daemon/wires.h"
#include "protocol/line_socket.h"

namespace zeropose {
namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;

constexpr std::chrono::milliseconds look_at_least_every =
    600ms;                              // a link comes round twice a second when idle
constexpr auto stalled_after = 3s;      // the cycle comes round every 100 ms when idle, and after every frame
constexpr auto cameras_tried_by = 10s;  // a dead address takes 2.5 s

struct Options {
  std::filesystem::path cell, state = "/var/lib/zeropose", socket = default_control_socket();
  std::string log_level = "info";
};

// SIGTERM and SIGINT are taken by the main thread only: block them before any thread is made.
sigset_t block_stop_signals() {
  sigset_t signals;
  sigemptyset(&signals);
  sigaddset(&signals, SIGTERM);
  sigaddset(&signals, SIGINT);
  pthread_sigmask(SIG_BLOCK, &signals, nullptr);
  return signals;
}

bool stop_wanted(const sigset_t& signals, std::chrono::milliseconds patience) {
  const timespec wait{patience.count() / 1000, (patience.count() % 1000) * 1000000};
  return sigtimedwait(&signals, nullptr, &wait) > 0;
}

EndpointOptions endpoint_options(const Cell& cell, std::size_t index) {
  const RobotOptions& robot = cell.robots[index];
  EndpointOptions options;
  options.handshake.robot = index;
  options.handshake.robot_index = static_cast<std::uint16_t>(index + 1);
  options.handshake.convention = robot.convention;
  options.handshake.frame = static_cast<std::uint16_t>(robot.frame);
  options.handshake.validity = robot.validity;
  options.handshake.measure_deadline = cell.deadline;
  options.handshake.zero_deadline = cell.zero_deadline;
  return options;
}

// The robots of a cell, and the wires that they hang on.
class Links {
 public:
  explicit Links(Cycle& cycle) {
    const Cell& cell = cycle.cell();
    for (std::size_t i = 0; i < cell.robots.size(); ++i) {
      endpoints_.push_back(std::make_unique<RobotEndpoint>(
          endpoint_options(cell, i), [&cycle](const Request& request) { cycle.enqueue(request); }));
      cycle.add_link(*endpoints_.back());
    }
    wires_ = open_wires(cell.robots, endpoints_);
    rounds_.resize(wires_.size());
    problems_.resize(wires_.size());
  }

  // Says once what keeps a wire from its robots, and once when it is gone.
  void log_problems() {
    for (std::size_t i = 0; i < wires_.size(); ++i) {
      const std::string problem = wires_[i]->problem();
      if (problem == problems_[i]) continue;
      if (problem.empty())
        spdlog::info("a robot's link is there again; it was: {}", problems_[i]);
      else
        spdlog::warn("a robot's link: {}", problem);
      problems_[i] = problem;
    }
  }

  // Withdraws every result and takes no more measurements, while the wires still tell the robots so.
  void withdraw() {
    for (const auto& endpoint : endpoints_) endpoint->set_cell_state(CellState{});
  }

  // True when the loop of every wire has come round since the last look.
  bool alive() {
    bool all = true;
    for (std::size_t i = 0; i < wires_.size(); ++i) {
      const std::uint64_t rounds = wires_[i]->rounds();
      all = all && rounds != rounds_[i];
      rounds_[i] = rounds;
    }
    return all;
  }

 private:
  std::vector<std::unique_ptr<RobotEndpoint>> endpoints_;
  std::vector<std::unique_ptr<Wire>> wires_;
  std::vector<std::uint64_t> rounds_;
  std::vector<std::string> problems_;
};

// Tells progress from standstill.
bool progresses(const Cycle& cycle, Links& links) {
  const bool cycle_alive = Clock::now() - cycle.last_progress() < stalled_after + cycle.cell().deadline;
  return links.alive() && cycle_alive;
}

// True when it was asked to stop.
bool wait_for_cameras(const Cycle& cycle, const sigset_t& signals) {
  const auto deadline = Clock::now() + cameras_tried_by;
  while (!cycle.status().cameras_known && Clock::now() < deadline)
    if (stop_wanted(signals, 50ms)) return true;
  return false;
}

void serve(const Cycle& cycle, Links& links, const sigset_t& signals) {
  const auto period = std::max(watchdog_interval().value_or(1s), look_at_least_every);
  bool alive = true;
  while (!stop_wanted(signals, period)) {
    const bool progress = progresses(cycle, links);
    links.log_problems();
    if (progress) notify_alive();
    if (alive && !progress)
      spdlog::critical("no progress in the cycle or a link: the watchdog is no longer fed");
    alive = progress;
  }
}

// The cycle publishes through the links: it stops before they go, also when something throws. From then on
// nobody looks whether a result still holds.
struct StopFirst {
  Cycle& cycle;
  Links& links;
  ~StopFirst() {
    cycle.stop();
    links.withdraw();
  }
};

void run(const Options& options) {
  const sigset_t signals = block_stop_signals();
  Cycle cycle(load_cell(options.cell), options.state);
  Links links(cycle);
  const StopFirst stop_first{cycle, links};
  cycle.start();
  const LineServer control(options.socket,
                           [&cycle](const std::string& line) { return answer_control(cycle, line); });
  if (wait_for_cameras(cycle, signals)) return;
  const Status status = cycle.status();
  spdlog::info("cell {}: job {}, {}", cycle.cell().name, status.job, status.ready ? "ready" : "not ready");
  notify_ready(status.ready ? "ready" : "not ready: see zeropose status");
  serve(cycle, links, signals);
  spdlog::info("stopping");
  notify_stopping();
}

}  // namespace
}  // namespace zeropose

int main(int argc, char** argv) {
  zeropose::Options options;
  CLI::App app("zeroposed: guides robots by cameras");
  app.set_version_flag("--version", zeropose::version_text("zeroposed"));
  app.add_option("--cell", options.cell, "the cell file (JSON)")->required();
  app.add_option("--state", options.state, "directory of zeros and compensations")->capture_default_str();
  app.add_option("--socket", options.socket, "Unix socket for the command line")->capture_default_str();
  app.add_option("--log-level", options.log_level, "debug, info, warn, error")
      ->capture_default_str()
      ->check(CLI::IsMember({"debug", "info", "warn", "error"}));
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : 2;
  }
  spdlog::set_default_logger(spdlog::stderr_color_mt("zeroposed"));
  spdlog::set_level(spdlog::level::from_str(options.log_level));
  try {
    zeropose::run(options);
    return 0;
  } catch (const zeropose::ConfigError& error) {
    std::cerr << error.what() << '\n';
    return 2;
  } catch (const std::exception& error) {
    spdlog::critical("{}", error.what());
    return 1;
  }
}
