// zeropose-cell: the simulated cell. Serves its cameras until it is stopped; a control socket moves the
// object and injects faults meanwhile.
#include <signal.h>

#include <CLI/CLI.hpp>
#include <atomic>
#include <cstdio>
#include <iostream>
#include <thread>

#include "config/config_error.h"
#include "protocol/line_socket.h"
#include "sim/cell_control.h"
#include "sim/drive.h"
#include "sim/gap_drive.h"
#include "sim/sim_file.h"

namespace zeropose {
namespace {

struct Options {
  std::filesystem::path cell, control;
  std::string shift, survey;
  std::vector<std::string> faults;
  bool drives = false;
  std::optional<int> cars;
  std::optional<std::uint64_t> seed;
};

std::string version_text() {
  return "zeropose-cell " ZEROPOSE_VERSION " (commit " ZEROPOSE_COMMIT ", build type " ZEROPOSE_BUILD_TYPE
         ")\nAravis " ZEROPOSE_ARAVIS_VERSION ", CLI11 " CLI11_VERSION;
}

// Sets a flag at SIGTERM or SIGINT. To be made before any other thread, which then leaves the signals to it.
class StopSignals {
 public:
  StopSignals() {
    sigemptyset(&signals_);
    for (const int signal : {SIGTERM, SIGINT}) sigaddset(&signals_, signal);
    pthread_sigmask(SIG_BLOCK, &signals_, nullptr);
    thread_ = std::jthread([this](const std::stop_token& token) { wait(token); });
  }
  const std::atomic<bool>& stopped() const { return stopped_; }

 private:
  void wait(const std::stop_token& token) {
    constexpr timespec patience{0, 100'000'000};
    while (!token.stop_requested() && sigtimedwait(&signals_, nullptr, &patience) < 0) continue;
    stopped_ = true;
    stopped_.notify_all();
  }

  sigset_t signals_{};
  std::atomic<bool> stopped_ = false;
  std::jthread thread_;
};

// The truth stands beside the cell file: car-body.json, car-body.sim.json.
std::filesystem::path sim_file_of(std::filesystem::path cell) { return cell.replace_extension(".sim.json"); }

// What the command line leaves open the truth file says.
DriveOptions drive_options(const Options& options) {
  const std::filesystem::path truth = sim_file_of(options.cell);
  const std::optional<DriveOptions> told = load_sim_file(truth).drive;
  if (!told) throw std::invalid_argument(truth.string() + " does not say what to drive: it has no key drive");
  DriveOptions drive = *told;
  drive.parts = options.cars;
  drive.seed = options.seed.value_or(drive.seed);
  return drive;
}

// Of a cell that evens gaps.
int run_gap_drive(const Options& options, const Cell& cell, SimulatedCell& simulated,
                  const std::atomic<bool>& stop) {
  const std::filesystem::path truth = sim_file_of(options.cell);
  std::optional<GapDriveOptions> drive = load_sim_file(truth).gap_drive;
  if (!drive)
    throw std::invalid_argument(truth.string() + " does not say what to drive: it has no key gap_drive");
  drive->parts = options.cars;
  drive->seed = options.seed.value_or(drive->seed);
  const auto show = [&simulated](const Pose& X_WO, const std::set<std::string>& covered) {
    simulated.cover(covered);
    simulated.show(X_WO);
  };
  const auto move_hand = [&simulated](std::size_t robot, const Pose& X_RH) {
    simulated.move_hand(robot, X_RH);
  };
  return drive_gaps(cell, std::get<GapsObject>(simulated.scene().object), {show, move_hand}, *drive, stop);
}

SurveyDrive survey_of(const Options& options) {
  const std::filesystem::path truth = sim_file_of(options.cell);
  for (SurveyDrive& survey : load_sim_file(truth).surveys)
    if (survey.name == options.survey) return load_marks(survey), survey;
  throw std::invalid_argument(truth.string() + " has no survey " + options.survey);
}

int run(const Options& options) {
  const StopSignals signals;
  const Cell cell = load_cell(options.cell);
  SimulatedCell simulated(cell, load_scenes(cell, sim_file_of(options.cell)));
  if (!options.shift.empty()) simulated.show(simulated.scene().X_WO_nominal * pose_from_text(options.shift));
  for (const std::string& fault : options.faults) set_fault(simulated, fault);
  std::optional<LineServer> control;
  if (!options.control.empty())
    control.emplace(options.control,
                    [&simulated](const std::string& line) { return answer_cell_control(simulated, line); });
  std::fprintf(stderr, "zeropose-cell: serving %zu cameras of cell %s\n", cell.cameras.size(),
               cell.name.c_str());
  const auto move_hand = [&simulated](std::size_t robot, const Pose& X_RH) {
    simulated.move_hand(robot, X_RH);
  };
  if (!options.survey.empty())
    return drive_survey(
        cell, survey_of(options),
        {[&simulated](const Carried& target) { simulated.show_target(target); },
         [&](std::size_t job) { simulated.show(job, cell.jobs[job].X_WO_nominal); }, move_hand},
        signals.stopped());
  if (options.drives && cell.jobs.front().gaps)
    return run_gap_drive(options, cell, simulated, signals.stopped());
  if (options.drives) {
    std::vector<Pose> X_WO0;
    for (const Job& job : cell.jobs) X_WO0.push_back(job.X_WO_nominal);
    return drive(cell, X_WO0,
                 {[&simulated](std::size_t job, const Pose& X_WO) { simulated.show(job, X_WO); }, move_hand},
                 drive_options(options), signals.stopped());
  }
  signals.stopped().wait(false);
  return 0;
}

void add_options(CLI::App& app, Options& options) {
  app.set_version_flag("--version", version_text());
  app.add_option("--cell", options.cell, "the cell file; the truth is read from CELL.sim.json beside it")
      ->required();
  app.add_option("--shift", options.shift, "where the object stands from its nominal pose: x,y,z,rx,ry,rz");
  app.add_option(
      "--fault", options.faults,
      "at the start: camera-dead:CAMERA, lose-packets:CAMERA, cover-mark:MARK, wrong-mark:MARK,\n"
      "cover-mark:'GAP dirt' (glint, hidden, taped), cover-mark:'SENSOR dirt 1', 'SENSOR line 1',\n"
      "camera-moved:CAMERA");
  app.add_option("--survey", options.survey,
                 "run the robot's program of this survey of the truth file: a camera's name, or its own");
  app.add_option("--control", options.control, "Unix socket that moves the object and injects faults");
  auto* drives =
      app.add_flag("--drive", options.drives,
                   "run the robot's program: one shifted part after the other, as the truth file says");
  app.add_option("--cars", options.cars, "with --drive: stop after so many parts")->needs(drives);
  app.add_option("--seed", options.seed, "with --drive: of the shifts")->needs(drives);
}

}  // namespace
}  // namespace zeropose

int main(int argc, char** argv) {
  CLI::App app("zeropose-cell: a simulated cell with cameras on loopback");
  zeropose::Options options;
  zeropose::add_options(app, options);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : 2;
  }
  try {
    return zeropose::run(options);
  } catch (const zeropose::ConfigError& error) {
    std::cerr << error.what() << '\n';
    return 2;
  } catch (const std::invalid_argument& error) {
    std::cerr << "zeropose-cell: " << error.what() << '\n';
    return 2;
  } catch (const std::exception& error) {
    std::cerr << "zeropose-cell: " << error.what() << '\n';
    return 1;
  }
}
