// A shipped cell that a test calibrates and runs with the commands of the guide.
#pragma once

#include <gtest/gtest.h>
#include <signal.h>

#include <fstream>
#include <nlohmann/json.hpp>

#include "config/cameras.h"
#include "tests/support/walking_line.h"

namespace zeropose {

// A shipped cell in a folder of its own.
class Site {
 public:
  explicit Site(const std::string& name) : name_(name) {
    for (const std::string& file : {name + ".json", name + ".calibration.json", name + ".sim.json",
                                    std::string("calibration-body.csv")})
      std::filesystem::copy(std::filesystem::path(ZEROPOSE_SOURCE_DIR) / "config/cells" / file,
                            folder / file);
  }

  std::string cell() const { return file(name_ + ".json"); }
  std::string file(const std::string& name) const { return folder / name; }

  std::unique_ptr<Process> simulated(const std::vector<std::string>& more) const {
    std::vector<std::string> command = {program_path("zeropose-cell"), "--cell", cell()};
    command.insert(command.end(), more.begin(), more.end());
    return std::make_unique<Process>(command, folder / "cell.log");
  }
  std::unique_ptr<Process> daemon() const {
    return std::make_unique<Process>(
        std::vector<std::string>{program_path("zeroposed"), "--cell", cell(), "--state", file("state"),
                                 "--socket", file("zeropose.sock")},
        folder / "daemon.log");
  }
  Finished zeropose(std::vector<std::string> arguments,
                    std::chrono::seconds patience = std::chrono::seconds(60)) const {
    arguments.insert(arguments.begin(), program_path("zeropose"));
    return run_program(arguments, patience);
  }
  void ask(std::vector<std::string> arguments) const {
    arguments.insert(arguments.end(), {"--socket", file("zeropose.sock")});
    const Finished answer = zeropose(arguments, std::chrono::seconds(120));
    ASSERT_EQ(answer.status, 0) << answer.out << answer.err;
  }

  // The robot goes through its own places, or where the daemon tells it to, while the daemon gathers. Writes
  // CAMERA-robot.csv and CAMERA-points.csv.
  void survey(const std::string& program, const std::string& camera,
              const std::vector<std::string>& more) const {
    const auto robot = simulated({"--survey", program});
    const auto running = daemon();
    ask({"status", "--wait", "30"});
    std::vector<std::string> arguments{"calibrate", "survey",
                                       "--camera",  camera,
                                       "--robot",   file(camera + "-robot.csv"),
                                       "--points",  file(camera + "-points.csv")};
    arguments.insert(arguments.end(), more.begin(), more.end());
    ask(arguments);
    const auto driven = robot->wait(std::chrono::seconds(20));
    if (testing::Test::HasFatalFailure() || driven != 0)
      FAIL() << program << ": the robot's status is " << driven.value_or(-1) << '\n'
             << text_of_file(folder / "cell.log") << text_of_file(folder / "daemon.log");
    running->signal(SIGTERM);
    EXPECT_EQ(running->wait(std::chrono::seconds(20)), 0);
  }

  // What a calibration answers; its camera is written to `output`.
  nlohmann::json calibrated(std::vector<std::string> arguments, const std::string& output) const {
    arguments.insert(arguments.begin(), "calibrate");
    arguments.insert(arguments.end(), {"--output", file(output), "--json"});
    const Finished answer = zeropose(arguments);
    EXPECT_EQ(answer.status, 0) << answer.out << answer.err;
    return nlohmann::json::parse(answer.out);
  }

  void activate(const std::string& camera, const std::string& from) const {
    const Finished activated = zeropose({"calibration", "activate", "--cell", cell(), "--camera", camera,
                                         "--from", file(from), "--why", "calibrated on site"});
    ASSERT_EQ(activated.status, 0) << activated.out << activated.err;
  }

  CalibratedCamera truth_of(const std::string& camera) const {
    const nlohmann::json truth =
        nlohmann::json::parse(std::ifstream(file(name_ + ".sim.json")), nullptr, true, true);
    return parse_cameras(nlohmann::json{{camera, truth["cameras"][camera]}}.dump(), "truth").front();
  }

  const TemporaryFolder folder;

 private:
  const std::string name_;
};

// Each number within 4.5 of its sigmas: seven numbers of two cameras would miss that once in 10000 times.
inline void expect_near(const std::array<double, 6>& found, const Pose& truth,
                        const std::array<double, 6>& sigma) {
  const SixNumbers six = to_six_numbers(truth);
  const std::array<double, 6> wanted{six.x_mm, six.y_mm, six.z_mm, six.rx_deg, six.ry_deg, six.rz_deg};
  for (std::size_t i = 0; i < 6; ++i)
    EXPECT_LT(std::abs(std::remainder(found[i] - wanted[i], 360.0 * (i < 3 ? 1e6 : 1))), 4.5 * sigma[i]) << i;
}

inline std::array<double, 6> sigmas_of_pose(const nlohmann::json& sigma) {
  return {sigma["x"], sigma["y"], sigma["z"], sigma["rx"], sigma["ry"], sigma["rz"]};
}

inline void expect_near(const nlohmann::json& internals, const nlohmann::json& sigma,
                        const CameraModel& truth) {
  EXPECT_NEAR(internals["fx"].get<double>(), truth.fx_px, 4.5 * sigma["fx"].get<double>());
  EXPECT_NEAR(internals["cx"].get<double>(), truth.cx_px, 4.5 * sigma["cx"].get<double>());
  EXPECT_NEAR(internals["cy"].get<double>(), truth.cy_px, 4.5 * sigma["cy"].get<double>());
}

}  // namespace zeropose
