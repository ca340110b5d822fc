// The parts of a drive: where each stands, what the robot got for it beside the truth, and the verdict.
#pragma once

#include <chrono>
#include <optional>
#include <random>
#include <vector>

#include "measure/code.h"
#include "measure/job.h"
#include "sim/drive.h"
#include "sim/hand_errors.h"
#include "sim/robot.h"

namespace zeropose {

// Where the parts of a job stand, X_O0O.
class Parts {
 public:
  Parts(const DriveOptions& options, const Job& job, std::uint64_t seed);
  Pose next();

 private:
  Pose drawn();
  Pose beyond_a_limit(const Pose& X_O0O, std::size_t turn) const;

  const DriveOptions& options_;
  const Job& job_;
  std::mt19937_64 generator_;
  std::size_t count_ = 0;
};

// A line for each answer, and a summary.
class PartLog {
 public:
  PartLog(const DriveOptions& options, const Job& job) : options_(options), job_(job) {}

  static void print_head();
  void next_part() { ++parts_; }
  void refused(const Pose& truth, const RobotAnswer& answer);
  void corrected(const Pose& truth, const Pose& received, std::chrono::microseconds time);
  // The exit status: 0 when every answer was within the figures.
  int summary() const;

 private:
  struct Corrected {
    Vector6 error = Vector6::Zero();  // mm, deg
    double at_points_mm = 0;          // at the worst application point
    double seconds = 0;               // command to answer, as the robot sees it
  };

  bool may_be(const Pose& truth, Code code) const;
  Corrected compared(const Pose& truth, const Pose& received, std::chrono::microseconds time) const;
  bool within_figures(const Corrected& part) const;
  void print_figures() const;

  const DriveOptions& options_;
  const Job& job_;
  std::vector<Corrected> done_;
  int parts_ = 0, bad_ = 0;
};

// Where an object was and where the robot takes it to be; without a correction nowhere.
struct Got {
  Pose X_O0O = Pose::Identity();
  std::optional<Pose> received;
};

// The robot takes the second object where it was told it is, and mounts it where it was told the first one
// is; both times its hand stands a little off.
class Mounting {
 public:
  Mounting(const DriveOptions& options, const Job& into);
  void mount(const Got& opening, const Got& pane);
  int summary() const;  // the exit status

 private:
  double most_mm_;
  std::vector<ApplicationPoint> points_;
  HandErrors hand_;
  std::vector<double> worst_mm_;
};

}  // namespace zeropose
