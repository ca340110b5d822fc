#include "sim/drive.h"

#include <algorithm>
#include <cstdio>
#include <random>
#include <thread>
#include <vector>

#include "sim/robot.h"

namespace zeropose {
namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;

SimulatedRobotOptions robot_options(const Cell& cell) {
  const RobotOptions& robot = cell.robots.front();
  SimulatedRobotOptions options;
  const auto& tcp = std::get<ModbusTcpOptions>(robot.link);
  options.address = tcp.address;
  options.port = tcp.port;
  options.unit = tcp.robot.unit.unit;
  options.convention = robot.convention;
  options.frame = static_cast<std::uint16_t>(robot.frame);
  options.first_request_id = std::random_device{}() | 1U;  // a robot that starts anew must not repeat its ids
  options.patience = cell.deadline + 500ms;
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

class Shifts {
 public:
  explicit Shifts(const DriveOptions& options)
      : generator_(options.seed),
        mm_(-options.shift_mm, options.shift_mm),
        deg_(-options.turn_deg, options.turn_deg) {}

  Pose next() {
    SixNumbers six;
    for (double* component : {&six.x_mm, &six.y_mm, &six.z_mm}) *component = mm_(generator_);
    for (double* component : {&six.rx_deg, &six.ry_deg, &six.rz_deg}) *component = deg_(generator_);
    return from_six_numbers(six);
  }

 private:
  std::mt19937_64 generator_;
  std::uniform_real_distribution<double> mm_, deg_;
};

struct Car {
  Vector6 error = Vector6::Zero();  // mm, deg
  double seconds = 0;               // command to answer, as the robot sees it
};

class Log {
 public:
  explicit Log(const DriveOptions& options) : options_(options) {
    std::printf("\n%5s | %-47s | %-47s | %-21s | %6s\n", "car", "correction received (X_O0O: mm, deg)",
                "truth", "worst error mm, deg", "ms");
  }

  void refused(const RobotAnswer& answer) {
    ++cars_;
    ++bad_;
    std::printf("%5d | no correction: %s (code %u)\n", cars_, answer.refusal.c_str(), answer.code);
    std::fflush(stdout);
  }

  void corrected(const Pose& truth, const Pose& received, std::chrono::microseconds time) {
    ++cars_;
    Car car;
    car.error = difference(truth, received);
    car.error.tail<3>() *= degrees_per_radian;
    car.seconds = std::chrono::duration<double>(time).count();
    done_.push_back(car);
    const double mm = car.error.head<3>().cwiseAbs().maxCoeff(),
                 deg = car.error.tail<3>().cwiseAbs().maxCoeff();
    const bool good = mm <= options_.max_error_mm && deg <= options_.max_error_deg;
    if (!good) ++bad_;
    std::printf("%5d |", cars_);
    print(received);
    print(truth);
    std::printf(" %8.4f %9.5f %s | %6.1f\n", mm, deg, good ? "ok" : "!!", 1000 * car.seconds);
    std::fflush(stdout);
  }

  int summary() {
    if (!done_.empty()) print_figures();
    std::printf("%d cars, %d not within %.3f mm and %.4f deg\n", cars_, bad_, options_.max_error_mm,
                options_.max_error_deg);
    return cars_ > 0 && bad_ == 0 ? 0 : 1;
  }

 private:
  static void print(const Pose& X_AB) {
    const SixNumbers s = to_six_numbers(X_AB);
    std::printf(" %7.3f %7.3f %7.3f %7.4f %7.4f %7.4f |", s.x_mm, s.y_mm, s.z_mm, s.rx_deg, s.ry_deg,
                s.rz_deg);
  }

  void print_figures() {
    Vector6 squares = Vector6::Zero();
    std::vector<double> ms;
    for (const Car& car : done_) {
      squares += car.error.cwiseAbs2();
      ms.push_back(1000 * car.seconds);
    }
    const Vector6 rms = (squares / static_cast<double>(done_.size())).cwiseSqrt();
    std::sort(ms.begin(), ms.end());
    std::printf("\nRMS error  x %.4f  y %.4f  z %.4f mm   rx %.5f  ry %.5f  rz %.5f deg\n", rms(0), rms(1),
                rms(2), rms(3), rms(4), rms(5));
    std::printf("command to answer: median %.1f ms, p99 %.1f ms, worst %.1f ms\n", ms[ms.size() / 2],
                ms[(ms.size() * 99) / 100], ms.back());
  }

  DriveOptions options_;
  std::vector<Car> done_;
  int cars_ = 0, bad_ = 0;
};

bool wait_until_ready(SimulatedRobot& robot, double seconds, const std::atomic<bool>& stop) {
  const auto deadline = Clock::now() + std::chrono::duration<double>(seconds);
  while (!stop && Clock::now() < deadline) {
    const RobotAnswer seen = robot.read();
    if (seen.block.state == LinkState::ready && seen.block.has(status_bit::ready)) return true;
    std::this_thread::sleep_for(100ms);
  }
  return false;
}

}  // namespace

int drive(const Cell& cell, const Pose& X_WO0, const ShowObject& show, const DriveOptions& options,
          const std::atomic<bool>& stop) {
  SimulatedRobot robot(robot_options(cell));
  if (!wait_until_ready(robot, options.ready_within_s, stop)) {
    if (!stop)
      std::fprintf(stderr, "the robot waited %.0f s for the daemon to be ready (zero measurement taken?)\n",
                   options.ready_within_s);
    return 1;
  }
  const auto job = static_cast<std::uint16_t>(cell.jobs.front().number);
  Shifts shifts(options);
  Log log(options);
  for (int car = 1; !stop && (!options.cars || car <= *options.cars); ++car) {
    const Pose X_O0O = shifts.next();
    show(X_WO0 * X_O0O);
    const RobotAnswer answer = robot.measure(job, static_cast<std::uint32_t>(car));
    if (answer.ok() && answer.correction)
      log.corrected(X_O0O, shift_from(cell.robots.front(), X_WO0, *answer.correction), answer.to_answer);
    else
      log.refused(answer);
    if (answer.ok()) robot.acknowledge();
  }
  return log.summary();
}

}  // namespace zeropose
