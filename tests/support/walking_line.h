// The whole line for tests: simulated cell, daemon and a robot, as processes in a private network.
#pragma once

#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>

#include "sim/robot.h"
#include "tests/support/process.h"
#include "tests/support/recorder.h"
#include "tests/support/temporary_folder.h"

namespace zeropose {

// Of each car with the wrong calibration of seed 1.
inline constexpr double line_error_mm = 0.4, line_error_deg = 0.012;

// The daemon is the one under test. ZEROPOSE_TOOLS may name a folder with the other programs: a daemon that
// is slow under a sanitizer needs a cell that keeps its times.
std::string program_path(const std::string& name);

// The robot of a line's cell: unit 1 on a port of its own, with robot-base shifts.
struct LineRobot {
  std::uint16_t port = 1502;
  Convention convention = Convention::kuka;
  Pose X_WR = from_six_numbers({1200, -2400, -150, 0, 0, 90});
  Pose X_WO0 = Pose::Identity();  // where the zero is taken
};

// Files live in `folder`: state/, control and notify sockets, logs.
class WalkingLine {
 public:
  explicit WalkingLine(std::filesystem::path cell = std::filesystem::path(ZEROPOSE_SOURCE_DIR) /
                                                    "config/cells/car-body.json",
                       const LineRobot& robot = {});

  void start_cell();
  void start_daemon();      // and waits for READY=1
  int stop_daemon();        // SIGTERM; its exit status, -1 when it does not end
  void wait_until_alive();  // all cameras
  void take_zero();         // by the command line
  void shift(const Pose& X_O0O);
  nlohmann::json fault(const std::string& kind, const nlohmann::json& more = nlohmann::json::object());
  nlohmann::json ask_cell(const nlohmann::json& question) const;
  nlohmann::json ask_daemon(const nlohmann::json& question) const;
  // The command line with --socket added for the verbs that need it.
  Finished zeropose(std::vector<std::string> arguments) const;

  SimulatedRobot& robot() { return robot_; }
  // The robot's Measure and Acknowledge, told to the recorder with the truth.
  RobotAnswer measure(std::optional<std::uint32_t> part = {});  // none: the request's number
  RobotAnswer acknowledge();
  // Watches from the first start of the daemon.
  Recorder& recorder() { return recorder_; }
  // The robot-base shift that a robot must be sent for an object at X_O0O from its zero, and how far it may
  // be off: the error of the rotation moves the robot's origin, which lies away from the object's.
  Pose correction_of(const Pose& X_O0O) const;
  double correction_error_mm() const;
  // The robot-base shift that the robot was sent, as X_O0O.
  Pose shift_from(const Pose& D_R) const;
  const std::filesystem::path& cell_file() const { return cell_; }
  std::filesystem::path state() const { return folder_ / "state"; }
  NotifyListener& notify() { return notify_; }
  std::string daemon_log() const;

  // Both end with the object; public so that a test can kill them.
  std::unique_ptr<Process> cell_process, daemon_process;

 private:
  TemporaryFolder folder_;
  std::filesystem::path cell_;
  LineRobot line_robot_;
  NotifyListener notify_;
  SimulatedRobot robot_;
  Recorder recorder_;
  bool watched_ = false;
  Pose X_O0O_ = Pose::Identity();  // where the object stands
};

}  // namespace zeropose
