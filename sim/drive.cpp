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

Vector6 numbers_of(const Pose& X_AB) {
  const SixNumbers s = to_six_numbers(X_AB);
  return {s.x_mm, s.y_mm, s.z_mm, s.rx_deg, s.ry_deg, s.rz_deg};
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

// Where the parts stand, X_O0O.
class Parts {
 public:
  Parts(const DriveOptions& options, const Job& job)
      : options_(options), job_(job), generator_(options.seed) {}

  Pose next() {
    const Pose X_O0O = options_.poses.empty() ? drawn() : options_.poses[count_ % options_.poses.size()];
    ++count_;
    const auto every = static_cast<std::size_t>(std::max(options_.beyond_every, 0));
    return every > 0 && count_ % every == 0 ? beyond_a_limit(X_O0O, count_ / every - 1) : X_O0O;
  }

 private:
  Pose drawn() {
    std::array<double, 6> six{};
    for (std::size_t axis = 0; axis < six.size(); ++axis) {
      const double most = options_.shift(static_cast<Eigen::Index>(axis));
      six[axis] = std::uniform_real_distribution<double>(-most, most)(generator_);
    }
    return from_six_numbers({six[0], six[1], six[2], six[3], six[4], six[5]});
  }

  // One axis after the other, those that are free; now at its upper end, now at its lower one.
  Pose beyond_a_limit(const Pose& X_O0O, std::size_t turn) const {
    constexpr double by = 0.1;  // of the range
    const std::vector<std::size_t> axes =
        job_.X_WP_planar ? std::vector<std::size_t>{0, 1, 5} : std::vector<std::size_t>{0, 1, 2, 3, 4, 5};
    const std::size_t axis = axes[turn % axes.size()];
    const Range& range = job_.requirements.limits[axis];
    const double room = by * (range.max - range.min);
    Vector6 six = numbers_of(X_O0O);
    six(static_cast<Eigen::Index>(axis)) = turn / axes.size() % 2 == 0 ? range.max + room : range.min - room;
    return from_six_numbers({six(0), six(1), six(2), six(3), six(4), six(5)});
  }

  const DriveOptions& options_;
  const Job& job_;
  std::mt19937_64 generator_;
  std::size_t count_ = 0;
};

// The codes that a part may get by its true place. Where the errors that are allowed do not tell, several.
std::vector<Code> expected_codes(const Vector6& truth, const std::array<Range, 6>& limits,
                                 const Vector6& max_error) {
  constexpr std::array codes{Code::limit_x,  Code::limit_y,  Code::limit_z,
                             Code::limit_rx, Code::limit_ry, Code::limit_rz};
  std::vector<Code> expected;
  for (std::size_t axis = 0; axis < codes.size(); ++axis) {
    const auto i = static_cast<Eigen::Index>(axis);
    const double beyond = std::max(truth(i) - limits[axis].max, limits[axis].min - truth(i));
    if (beyond > -max_error(i)) expected.push_back(codes[axis]);
    if (beyond > max_error(i)) return expected;
  }
  expected.push_back(Code::ok);
  return expected;
}

struct Corrected {
  Vector6 error = Vector6::Zero();  // mm, deg
  double at_points_mm = 0;          // at the worst application point
  double seconds = 0;               // command to answer, as the robot sees it
};

class Log {
 public:
  Log(const DriveOptions& options, const Job& job) : options_(options), job_(job) {
    std::printf("\n%5s | %-47s | %-47s | %-21s | %6s\n", "part", "correction received (X_O0O: mm, deg)",
                "truth", "worst error mm, deg", "ms");
  }

  void next_part() { ++parts_; }

  void refused(const Pose& truth, const RobotAnswer& answer) {
    const bool good = answer.code != 0 && may_be(truth, static_cast<Code>(answer.code));
    bad_ += good ? 0 : 1;
    if (good)
      std::printf("%5d | beyond its limit and refused: code %u\n", parts_, answer.code);
    else
      std::printf("%5d | no correction: %s (code %u)\n", parts_, answer.refusal.c_str(), answer.code);
    std::fflush(stdout);
  }

  void corrected(const Pose& truth, const Pose& received, std::chrono::microseconds time) {
    const Corrected part = compared(truth, received, time);
    done_.push_back(part);
    const bool good = within_figures(part) && may_be(truth, Code::ok);
    bad_ += good ? 0 : 1;
    std::printf("%5d |", parts_);
    print(received);
    print(truth);
    std::printf(" %8.4f %9.5f %s | %6.1f\n", part.error.head<3>().cwiseAbs().maxCoeff(),
                part.error.tail<3>().cwiseAbs().maxCoeff(), good ? "ok" : "!!", 1000 * part.seconds);
    std::fflush(stdout);
  }

  int summary() {
    if (!done_.empty()) print_figures();
    const Vector6& most = options_.max_error;
    std::printf("%d parts, %d answers not within %g %g %g mm and %g %g %g deg", parts_, bad_, most(0),
                most(1), most(2), most(3), most(4), most(5));
    if (options_.max_error_at_points_mm > 0)
      std::printf(", %g mm at the application points", options_.max_error_at_points_mm);
    std::printf("%s\n", options_.beyond_every > 0 ? ", or with a wrong verdict" : "");
    return parts_ > 0 && bad_ == 0 ? 0 : 1;
  }

 private:
  bool may_be(const Pose& truth, Code code) const {
    const auto expected = expected_codes(numbers_of(truth), job_.requirements.limits, options_.max_error);
    return std::ranges::find(expected, code) != expected.end();
  }

  Corrected compared(const Pose& truth, const Pose& received, std::chrono::microseconds time) const {
    Corrected part;
    part.error = difference(truth, received);
    part.error.tail<3>() *= degrees_per_radian;
    for (const ApplicationPoint& point : job_.application_points)
      part.at_points_mm =
          std::max(part.at_points_mm, (received * point.p_O_mm - truth * point.p_O_mm).norm());
    part.seconds = std::chrono::duration<double>(time).count();
    return part;
  }

  bool within_figures(const Corrected& part) const {
    const double most_mm = options_.max_error_at_points_mm;
    return (part.error.cwiseAbs().array() <= options_.max_error.array()).all() &&
           (most_mm <= 0 || part.at_points_mm <= most_mm);
  }

  static void print(const Pose& X_AB) {
    const SixNumbers s = to_six_numbers(X_AB);
    std::printf(" %7.3f %7.3f %7.3f %7.4f %7.4f %7.4f |", s.x_mm, s.y_mm, s.z_mm, s.rx_deg, s.ry_deg,
                s.rz_deg);
  }

  void print_figures() {
    Vector6 squares = Vector6::Zero();
    std::vector<double> ms;
    double at_points_mm = 0;
    for (const Corrected& part : done_) {
      squares += part.error.cwiseAbs2();
      ms.push_back(1000 * part.seconds);
      at_points_mm = std::max(at_points_mm, part.at_points_mm);
    }
    const Vector6 rms = (squares / static_cast<double>(done_.size())).cwiseSqrt();
    std::sort(ms.begin(), ms.end());
    std::printf("\nRMS error  x %.4f  y %.4f  z %.4f mm   rx %.5f  ry %.5f  rz %.5f deg\n", rms(0), rms(1),
                rms(2), rms(3), rms(4), rms(5));
    std::printf("largest error at the application points %.4f mm\n", at_points_mm);
    std::printf("command to answer: median %.1f ms, p99 %.1f ms, worst %.1f ms\n", ms[ms.size() / 2],
                ms[(ms.size() * 99) / 100], ms.back());
  }

  const DriveOptions& options_;
  const Job& job_;
  std::vector<Corrected> done_;
  int parts_ = 0, bad_ = 0;
};

// The robot goes through the job's positions and tells each.
class Tour {
 public:
  Tour(const Cell& cell, const DrivenCell& driven, const DriveOptions& options, SimulatedRobot& robot)
      : cell_(cell),
        job_(cell.jobs.front()),
        driven_(driven),
        robot_(robot),
        errors_(options.robot, job_.positions.size(), options.seed + 1000) {}

  // The answer that ended it; ok when every position was taken.
  RobotAnswer go(std::uint32_t part) {
    RobotAnswer answer;
    answer.refusal.clear();
    for (std::size_t i = 0; i < job_.positions.size() && answer.ok(); ++i) {
      const HandPosition& position = job_.positions[i];
      driven_.move_hand(*cell_.hand_of[position.camera], errors_.true_hand(i, position.X_RH));
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

// From the pictures of as many rounds as the cell averages over.
RobotAnswer zero_from_hand(const Cell& cell, Tour& tour, SimulatedRobot& robot) {
  RobotAnswer answer;
  answer.refusal.clear();
  for (int round = 0; round < cell.zero_frames && answer.ok(); ++round) answer = tour.go(0);
  return answer.ok() ? robot.zero(static_cast<std::uint16_t>(cell.jobs.front().number)) : answer;
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

int drive(const Cell& cell, const Pose& X_WO0, const DrivenCell& driven, const DriveOptions& options,
          const std::atomic<bool>& stop) {
  SimulatedRobot robot(driving_robot(cell, options));
  Tour tour(cell, driven, options, robot);
  RobotAnswer zero;
  if (!cell.jobs.front().positions.empty() && !done_within(options.ready_within_s, stop, [&] {
        zero = zero_from_hand(cell, tour, robot);
        return zero.ok();
      }))
    std::fprintf(stderr, "no zero measurement: %s (code %u)\n", zero.refusal.c_str(), zero.code);
  if (!done_within(options.ready_within_s, stop, [&] { return is_ready(robot); })) {
    if (!stop)
      std::fprintf(stderr, "the robot waited %.0f s for the daemon to be ready (zero measurement taken?)\n",
                   options.ready_within_s);
    return 1;
  }
  const Job& job = cell.jobs.front();
  Parts parts(options, job);
  Log log(options, job);
  CanRobots others(cell, options);
  for (int part = 1; !stop && (!options.parts || part <= *options.parts); ++part) {
    const Pose X_O0O = parts.next();
    const auto report = [&](const RobotOptions& asking, const RobotAnswer& answer) {
      if (answer.ok() && answer.correction)
        log.corrected(X_O0O, shift_from(asking, X_WO0, *answer.correction), answer.to_answer);
      else
        log.refused(X_O0O, answer);
    };
    log.next_part();
    driven.show(X_WO0 * X_O0O);
    RobotAnswer answer = tour.go(static_cast<std::uint32_t>(part));
    if (answer.ok())
      answer = robot.measure(static_cast<std::uint16_t>(job.number), static_cast<std::uint32_t>(part));
    report(cell.robots.front(), answer);
    if (answer.ok()) robot.acknowledge();
    others.measure(job, static_cast<std::uint32_t>(part), report);
  }
  return log.summary();
}

}  // namespace zeropose
