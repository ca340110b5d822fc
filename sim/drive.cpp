#include "sim/drive.h"

#include <algorithm>
#include <array>
#include <cstdio>
#include <functional>
#include <memory>
#include <random>
#include <thread>
#include <vector>

#include "measure/code.h"
#include "sim/can_robot.h"
#include "sim/part_log.h"
#include "sim/robot.h"

namespace zeropose {
namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;

SimulatedRobotOptions driving_robot(const Cell& cell, const DriveOptions& drive) {
  SimulatedRobotOptions options = robot_options(cell, 0);
  options.max_translation_mm = drive.robot_max_mm;
  options.max_rotation_deg = drive.robot_max_deg;
  return options;
}

// What a robot that got `delivered` takes the shift X_O0O to be; the inverse of what the daemon does for its
// frame.
Pose shift_from(const RobotOptions& robot, const Pose& X_WO0, const Pose& delivered) {
  switch (robot.frame) {
    case CorrectionFrame::world_shift:
      return X_WO0.inverse() * delivered * X_WO0;
    case CorrectionFrame::robot_base_shift:
      return X_WO0.inverse() * (robot.X_WR * delivered * robot.X_WR.inverse()) * X_WO0;
    case CorrectionFrame::user_frame:
      return X_WO0.inverse() * robot.X_WR * delivered;
    default:
      return delivered;
  }
}

// The robot goes through the job's positions and tells each.
class Tour {
 public:
  Tour(const Cell& cell, const Job& job, const DrivenCell& driven, const DriveOptions& options,
       SimulatedRobot& robot)
      : cell_(cell),
        job_(job),
        driven_(driven),
        robot_(robot),
        errors_(options.robot, job_.positions.size(),
                options.seed + 1000 * static_cast<std::uint64_t>(job_.number)) {}

  // Where the cell has other jobs as well.
  RobotAnswer select() {
    RobotAnswer answer;
    answer.refusal.clear();
    return cell_.jobs.size() > 1 ? robot_.select_job(static_cast<std::uint16_t>(job_.number)) : answer;
  }

  // The answer that ended it; ok when every position was taken.
  RobotAnswer go(std::uint32_t part) {
    RobotAnswer answer;
    answer.refusal.clear();
    for (std::size_t i = 0; i < job_.positions.size() && answer.ok(); ++i) {
      const HandPosition& position = job_.positions[i];
      driven_.move_hand(*cell_.hand_of[position.cameras.front()], errors_.true_hand(i, position.X_RH));
      answer = robot_.at_position(static_cast<std::uint16_t>(job_.number), part,
                                  static_cast<std::int32_t>(i + 1), position.X_RH);
    }
    return answer;
  }

 private:
  const Cell& cell_;
  const Job& job_;
  const DrivenCell& driven_;
  SimulatedRobot& robot_;
  HandErrors errors_;
};

// What the robot does for one of the cell's jobs.
struct Station {
  Station(const Cell& cell, std::size_t index, const Pose& X_WO0_of_job, const DrivenCell& driven,
          const DriveOptions& options, SimulatedRobot& robot)
      : job(cell.jobs[index]),
        number(static_cast<std::uint16_t>(job.number)),
        X_WO0(X_WO0_of_job),
        parts(options, job, options.seed + index),
        log(options, job),
        tour(cell, job, driven, options, robot),
        show([&driven, index](const Pose& X_WO) { driven.show(index, X_WO); }) {}

  const Job& job;
  std::uint16_t number;
  Pose X_WO0;
  Parts parts;
  PartLog log;
  Tour tour;
  std::function<void(const Pose& X_WO)> show;
};

using Stations = std::vector<std::unique_ptr<Station>>;

bool robot_takes_zeros(const Cell& cell) {
  return cell.jobs.size() > 1 || !cell.jobs.front().positions.empty();
}

// The zero of every job, from the pictures of as many rounds as the cell averages over.
RobotAnswer take_zeros(const Cell& cell, const Stations& stations, SimulatedRobot& robot) {
  RobotAnswer answer;
  for (const auto& station : stations) {
    station->show(station->X_WO0);
    answer = station->tour.select();
    for (int round = 0; round < cell.zero_frames && answer.ok(); ++round) answer = station->tour.go(0);
    if (answer.ok()) answer = robot.zero(station->number);
    if (!answer.ok()) break;
  }
  return answer;
}

// The cell's robots on CAN buses that there are here; they ask for the same parts.
class CanRobots {
 public:
  CanRobots(const Cell& cell, const DriveOptions& options) {
    for (const RobotOptions& robot : cell.robots) {
      const auto* can = std::get_if<CanOptions>(&robot.link);
      if (can == nullptr) continue;
      SimulatedCanRobotOptions its{*can, robot.convention, options.robot_max_mm, options.robot_max_deg};
      its.patience = cell.deadline + 500ms;
      its.first_request_id = static_cast<std::uint16_t>(std::random_device{}() | 1U);
      try {
        robots_.push_back({&robot, std::make_unique<SimulatedCanRobot>(its)});
        std::printf("%s asks as well, on %s\n", robot.name.c_str(), can->interface.c_str());
      } catch (const std::runtime_error& error) {
        std::printf("%s does not drive: %s\n", robot.name.c_str(), error.what());
      }
    }
  }

  void measure(const Job& job, std::uint32_t part,
               const std::function<void(const RobotOptions&, const RobotAnswer&)>& report) {
    for (const auto& [options, robot] : robots_) {
      const RobotAnswer answer = robot->measure(static_cast<std::uint8_t>(job.number), part);
      report(*options, answer);
      robot->acknowledge();
    }
  }

 private:
  struct Driven {
    const RobotOptions* options;
    std::unique_ptr<SimulatedCanRobot> robot;
  };
  std::vector<Driven> robots_;
};

class Driver {
 public:
  Driver(const Cell& cell, const DriveOptions& options, SimulatedRobot& robot)
      : cell_(cell), robot_(robot), others_(cell, options) {}

  Got guide(Station& station, std::uint32_t part) {
    Got got{station.parts.next(), {}};
    const auto report = [&](const RobotOptions& asking, const RobotAnswer& answer) {
      if (!answer.ok() || !answer.correction) return station.log.refused(got.X_O0O, answer);
      const Pose received = shift_from(asking, station.X_WO0, *answer.correction);
      if (&asking == &cell_.robots.front()) got.received = received;
      station.log.corrected(got.X_O0O, received, answer.to_answer);
    };
    station.log.next_part();
    station.show(station.X_WO0 * got.X_O0O);
    const RobotAnswer answer = ask(station, part);
    report(cell_.robots.front(), answer);
    if (answer.ok()) robot_.acknowledge();
    others_.measure(station.job, part, report);
    return got;
  }

 private:
  RobotAnswer ask(Station& station, std::uint32_t part) {
    RobotAnswer answer = station.tour.select();
    if (answer.ok()) answer = station.tour.go(part);
    return answer.ok() ? robot_.measure(station.number, part) : answer;
  }

  const Cell& cell_;
  SimulatedRobot& robot_;
  CanRobots others_;
};

bool is_ready(SimulatedRobot& robot) {
  const ResultBlock block = robot.read().block;
  return block.state == LinkState::ready && block.has(status_bit::ready);
}

}  // namespace

SimulatedRobotOptions robot_options(const Cell& cell, std::size_t index) {
  const RobotOptions& robot = cell.robots.at(index);
  const auto* tcp = std::get_if<ModbusTcpOptions>(&robot.link);
  if (tcp == nullptr)
    throw std::invalid_argument("robot " + robot.name + " is not driven: its link is no Modbus TCP server");
  SimulatedRobotOptions options;
  options.address = tcp->address;
  options.port = tcp->port;
  options.unit = tcp->robot.unit.unit;
  options.convention = robot.convention;
  options.frame = static_cast<std::uint16_t>(robot.frame);
  options.robot_index = static_cast<std::uint16_t>(index + 1);
  options.first_request_id = std::random_device{}() | 1U;  // a robot that starts anew must not repeat its ids
  options.patience = cell.deadline + 500ms;
  return options;
}

bool done_within(double seconds, const std::atomic<bool>& stop, const std::function<bool()>& done) {
  const auto deadline = Clock::now() + std::chrono::duration<double>(seconds);
  while (!stop && Clock::now() < deadline) {
    if (done()) return true;
    std::this_thread::sleep_for(100ms);
  }
  return false;
}

int drive(const Cell& cell, const std::vector<Pose>& X_WO0, const DrivenCell& driven,
          const DriveOptions& options, const std::atomic<bool>& stop) {
  SimulatedRobot robot(driving_robot(cell, options));
  Stations stations;
  for (std::size_t job = 0; job < cell.jobs.size(); ++job)
    stations.push_back(std::make_unique<Station>(cell, job, X_WO0.at(job), driven, options, robot));
  RobotAnswer zero;
  if (robot_takes_zeros(cell) && !done_within(options.ready_within_s, stop, [&] {
        zero = take_zeros(cell, stations, robot);
        return zero.ok();
      }))
    std::fprintf(stderr, "no zero measurement: %s (code %u)\n", zero.refusal.c_str(), zero.code);
  if (!done_within(options.ready_within_s, stop, [&] { return is_ready(robot); })) {
    if (!stop)
      std::fprintf(stderr, "the robot waited %.0f s for the daemon to be ready (zero measurement taken?)\n",
                   options.ready_within_s);
    return 1;
  }
  Driver driver(cell, options, robot);
  Mounting mounting(options, cell.jobs.front());
  PartLog::print_head();
  for (int part = 1; !stop && (!options.parts || part <= *options.parts); ++part) {
    std::vector<Got> got;
    for (const auto& station : stations)
      got.push_back(driver.guide(*station, static_cast<std::uint32_t>(part)));
    if (got.size() == 2) mounting.mount(got[0], got[1]);
  }
  int status = 0;
  for (const auto& station : stations) status |= station->log.summary();
  return stations.size() == 2 ? status | mounting.summary() : status;
}

}  // namespace zeropose
