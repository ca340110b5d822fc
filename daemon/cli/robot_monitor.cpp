#include "daemon/cli/robot_monitor.h"

#include <algorithm>
#include <chrono>
#include <memory>
#include <optional>
#include <thread>

#include "config/text.h"
#include "daemon/cli/answer.h"
#include "daemon/cli/robot_block.h"
#include "daemon/cli/robot_choice.h"
#include "protocol/modbus_peer.h"

namespace zeropose {
namespace {

using namespace cli;
using std::chrono::milliseconds;
using std::chrono::steady_clock;

struct MonitorOptions {
  std::string cell, robot, address;
  std::uint16_t port = 0;
  int unit = 0;
  std::uint16_t data_id = default_result_data_id;
  int period_ms = 50, timeout_ms = 1000;
  std::size_t count = 0;
  double seconds = 0;
  bool json = false;
};

constexpr const char* monitor_help =
    R"(Only reads (FC04), so it does not disturb the robot: its address must be among those that the robot's link allows
to read or write. One line for each change of the block; the age alone is no change. A block that must not be
used is said to be wrong, and why. Without --count and --seconds it goes on until Ctrl-C.
Examples:
  zeropose robot monitor --cell cell.json --robot left
  zeropose robot monitor --address 127.0.0.1 --port 1502 --unit 1 --seconds 10 --json
Exit status: 0 the last look found a block that can be used; 1 not; 2 wrong usage or an unreadable cell file.)";

// One look at the block.
struct Look {
  std::optional<ResultBlock> block;
  std::string failure;  // empty: there is a block
};

ModbusPeerOptions peer_of(const MonitorOptions& options) {
  ModbusTcpAddress where;
  ModbusPeerOptions peer;
  if (!options.cell.empty()) {
    const RobotOptions robot = robot_of_cell(options.cell, options.robot);
    const auto* tcp = std::get_if<ModbusTcpOptions>(&robot.link);
    if (tcp == nullptr)
      throw std::invalid_argument("robot " + robot.name + " is reached by " + describe(robot.link) +
                                  "; only links of type modbus-tcp can be monitored");
    where = {tcp->address == "0.0.0.0" ? "127.0.0.1" : tcp->address, tcp->port};
    peer.unit = tcp->robot.unit.unit;
  } else if (options.address.empty() && options.port == 0) {
    throw std::invalid_argument("which robot? Give --cell and --robot, or --address, --port and --unit");
  }
  if (!options.address.empty()) where.address = options.address;
  if (options.port != 0) where.port = options.port;
  if (options.unit != 0) peer.unit = static_cast<std::uint8_t>(options.unit);
  peer.where = where;
  peer.response_timeout = milliseconds(options.timeout_ms);
  peer.result_data_id = options.data_id;
  return peer;
}

std::string explained(const PeerFailure& failure) {
  if (failure.problem == PeerProblem::connection_lost)
    return failure.text +
           "; is this computer's address among the allowed readers of the robot's link, and the unit id "
           "right?";
  return failure.text;
}

Look look(ModbusPeer& peer) {
  if (const auto failure = peer.connect()) return {std::nullopt, explained(*failure)};
  const BlockAnswer answer = peer.read_block();
  if (answer.failure) return {std::nullopt, explained(*answer.failure)};
  if (answer.decoded.problem) return {std::nullopt, cli::text_of(*answer.decoded.problem)};
  return {answer.decoded.block, ""};
}

// The age grows all the time and is no change.
bool is_new(const Look& now, const std::optional<Look>& before) {
  if (!before || now.failure != before->failure || now.block.has_value() != before->block.has_value())
    return true;
  if (!now.block) return false;
  ResultBlock of_before = *before->block;
  of_before.age_ms = now.block->age_ms;
  return of_before != *now.block;
}

void print_look(const Look& look, double seconds, bool json) {
  if (json) {
    Json line{{"seconds", seconds},
              {"status", look.block ? "ok" : "failed"},
              {"reason", look.failure},
              {"block", look.block ? block_json(*look.block) : Json()}};
    std::cout << line.dump() << std::endl;
    return;
  }
  std::cout << std::fixed << std::setprecision(3) << std::setw(9) << seconds << " s  "
            << (look.block ? block_text(*look.block) : "NO BLOCK: " + look.failure) << std::endl;
}

bool usable(const Look& look) { return look.block && oddities(*look.block).empty(); }

int monitor(const MonitorOptions& options) {
  ModbusPeer peer(peer_of(options));
  const bool endless = options.count == 0 && options.seconds == 0;
  const auto begin = steady_clock::now();
  std::optional<Look> before;
  std::size_t lines = 0;
  while (true) {
    const Look now = look(peer);
    const double seconds = std::chrono::duration<double>(steady_clock::now() - begin).count();
    if (is_new(now, before)) {
      print_look(now, seconds, options.json);
      ++lines;
    }
    const bool never_reached = endless && !before && !now.block;
    before = now;
    if (never_reached || (options.count && lines >= options.count) ||
        (options.seconds > 0 && seconds >= options.seconds))
      return usable(now) ? done : no_answer;
    std::this_thread::sleep_for(milliseconds(options.period_ms));
  }
}

// Unlike other verbs this one prints as it goes; only wrong input is left for the common way.
int run_monitor(const MonitorOptions& options) {
  try {
    return monitor(options);
  } catch (const std::exception&) {
    return run([]() -> Answer { throw; }, options.json);
  }
}

}  // namespace

void add_robot_monitor(cli::Verb robot, int& exit_status) {
  auto options = std::make_shared<MonitorOptions>();
  const Verb verb =
      robot.add_subcommand("monitor", "A robot's result block over Modbus TCP, decoded, as it changes");
  verb.add_option("--cell", options->cell, "the cell file that says where the robot's link listens");
  verb.add_option("--robot", options->robot, "its name in the cell (the only one where there is one)");
  verb.add_option("--address", options->address, "numeric address instead, or another one than in the cell");
  verb.add_option("--port", options->port, "TCP port (1502)").range(1, 65535);
  verb.add_option("--unit", options->unit, "unit id (1)").range(1, 247);
  verb.add_option("--data-id", options->data_id, "in the block's CRC (0x5A50)").range(0, 65535);
  verb.add_option("--period-ms", options->period_ms, "between two looks (50)").range(5, 60000);
  verb.add_option("--timeout-ms", options->timeout_ms, "for connecting, and for an answer (1000)")
      .range(10, 60000);
  verb.add_option("--count", options->count, "end after so many lines");
  verb.add_option("--seconds", options->seconds, "end after this time").range(0.001, 1e7);
  verb.add_flag("--json", options->json, "each line a JSON object: seconds, status, reason, block {...}");
  verb.footer(monitor_help);
  verb.callback([options, &exit_status] { exit_status = run_monitor(*options); });
}

}  // namespace zeropose
