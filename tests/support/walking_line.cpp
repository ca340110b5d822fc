#include "tests/support/walking_line.h"

#include <gtest/gtest.h>
#include <signal.h>
#include <unistd.h>

#include <cstdlib>
#include <fstream>
#include <sstream>
#include <thread>

namespace zeropose {
namespace {

using namespace std::chrono_literals;
using Json = nlohmann::json;

constexpr auto start_patience = 60s;  // sanitizers are slow

SimulatedRobotOptions robot_options(const LineRobot& robot) {
  SimulatedRobotOptions options;
  options.port = robot.port;
  options.convention = robot.convention;
  options.frame = 3;
  options.first_request_id = 1000;
  return options;
}

RecorderOptions recorder_options(const LineRobot& robot) {
  RecorderOptions options;
  options.convention = robot.convention;
  return options;
}

}  // namespace

std::string program_path(const std::string& name) {
  const char* tools = name == "zeroposed" ? nullptr : std::getenv("ZEROPOSE_TOOLS");
  return (tools != nullptr ? std::filesystem::path(tools) : program_folder()) / name;
}

WalkingLine::WalkingLine(std::filesystem::path cell, const LineRobot& robot)
    : cell_(std::move(cell)),
      line_robot_(robot),
      notify_(folder_ / "notify.sock"),
      robot_(robot_options(robot)),
      recorder_(recorder_options(robot)) {}

void WalkingLine::start_cell() {
  cell_process = std::make_unique<Process>(
      std::vector<std::string>{program_path("zeropose-cell"), "--cell", cell_.string(), "--control",
                               (folder_ / "cell.sock").string()},
      folder_ / "cell.log");
  const auto deadline = std::chrono::steady_clock::now() + start_patience;
  while (!std::filesystem::exists(folder_ / "cell.sock") && std::chrono::steady_clock::now() < deadline)
    std::this_thread::sleep_for(20ms);
  ask_cell({{"cmd", "truth"}});
}

void WalkingLine::start_daemon() {
  daemon_process = std::make_unique<Process>(
      std::vector<std::string>{program_path("zeroposed"), "--cell", cell_.string(), "--state",
                               state().string(), "--socket", (folder_ / "zeropose.sock").string()},
      folder_ / "daemon.log",
      std::vector<std::string>{"NOTIFY_SOCKET=" + (folder_ / "notify.sock").string(),
                               "WATCHDOG_USEC=2000000"});
  if (!notify_.heard("READY=1", start_patience))
    throw std::runtime_error("the daemon is not READY:\n" + daemon_log());
  if (!watched_) recorder_.watch("127.0.0.1", line_robot_.port);
  watched_ = true;
}

int WalkingLine::stop_daemon() {
  daemon_process->signal(SIGTERM);
  const int status = daemon_process->wait(20s).value_or(-1);
  daemon_process.reset();
  return status;
}

void WalkingLine::wait_until_alive() {
  const Finished status = zeropose({"status", "--wait", "30"});
  if (status.out.find("MISSING") != std::string::npos) throw std::runtime_error(status.out);
}

void WalkingLine::take_zero() {
  wait_until_alive();
  const Finished zero = zeropose({"zero"});
  if (zero.status != 0) throw std::runtime_error("no zero: " + zero.out + zero.err);
}

RobotAnswer WalkingLine::measure(std::optional<std::uint32_t> part) {
  const std::uint32_t id = robot_.next_request_id();
  recorder_.requested(id);
  recorder_.truth(id, correction_of(X_O0O_), correction_error_mm(), 2 * line_error_deg);
  return robot_.measure(1, part.value_or(id));
}

RobotAnswer WalkingLine::acknowledge() {
  const std::uint32_t id = robot_.next_request_id() - 1;
  const RobotAnswer answer = robot_.acknowledge();
  if (answer.ok()) recorder_.withdrawn(id);
  return answer;
}

Json WalkingLine::ask_cell(const Json& question) const {
  const Json answer = Json::parse(ask(folder_ / "cell.sock", question.dump(), 30s));
  if (answer.value("status", "") != "ok") throw std::runtime_error("the cell says " + answer.dump());
  return answer;
}

Json WalkingLine::ask_daemon(const Json& question) const {
  return Json::parse(ask(folder_ / "zeropose.sock", question.dump(), 30s));
}

void WalkingLine::shift(const Pose& X_O0O) {
  X_O0O_ = X_O0O;
  const SixNumbers s = to_six_numbers(X_O0O);
  ask_cell({{"cmd", "shift"}, {"pose", {s.x_mm, s.y_mm, s.z_mm, s.rx_deg, s.ry_deg, s.rz_deg}}});
}

Json WalkingLine::fault(const std::string& kind, const Json& more) {
  Json question{{"cmd", "fault"}, {"kind", kind}};
  question.update(more);
  return ask_cell(question);
}

Finished WalkingLine::zeropose(std::vector<std::string> arguments) const {
  arguments.insert(arguments.begin(), program_path("zeropose"));
  arguments.insert(arguments.end(), {"--socket", (folder_ / "zeropose.sock").string()});
  return run_program(arguments);
}

Pose WalkingLine::correction_of(const Pose& X_O0O) const {
  const Pose X_RO0 = line_robot_.X_WR.inverse() * line_robot_.X_WO0;
  return X_RO0 * X_O0O * X_RO0.inverse();
}

double WalkingLine::correction_error_mm() const {
  const double lever_mm = (line_robot_.X_WR.inverse() * line_robot_.X_WO0).translation().norm();
  return line_error_mm + lever_mm * line_error_deg / degrees_per_radian;
}

Pose WalkingLine::shift_from(const Pose& D_R) const {
  const Pose X_RO0 = line_robot_.X_WR.inverse() * line_robot_.X_WO0;
  return X_RO0.inverse() * D_R * X_RO0;
}

std::string WalkingLine::daemon_log() const {
  std::stringstream text;
  text << std::ifstream(folder_ / "daemon.log").rdbuf();
  return text.str();
}

}  // namespace zeropose
