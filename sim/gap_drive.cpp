#include "sim/gap_drive.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <cstdio>
#include <vector>

#include "measure/code.h"
#include "sim/drive.h"
#include "sim/random.h"
#include "sim/robot.h"

namespace zeropose {
namespace {

using Clock = std::chrono::steady_clock;

// What a robot that is told to go there does.
Pose with_gain(const Pose& X_AB, const Vector6& gain) {
  const SixNumbers s = to_six_numbers(X_AB);
  return from_six_numbers({gain(0) * s.x_mm, gain(1) * s.y_mm, gain(2) * s.z_mm, gain(3) * s.rx_deg,
                           gain(4) * s.ry_deg, gain(5) * s.rz_deg});
}

bool is_nothing(const Pose& X_AB) {
  return X_AB.translation().norm() < 1e-9 && log_so3(X_AB.linear()).norm() < 1e-12;
}

// One car: what stands where, and what became of it.
struct Car {
  Pose X_WO = Pose::Identity(), X_RH = Pose::Identity();  // the hand as the robot means it
  Pose X_RH_true = Pose::Identity();
  Vector6 gain = Vector6::Ones();
  std::set<std::string> covered;
  int motions = 0;
  bool even = false;
  std::uint16_t code = 0;  // of a refusal
  std::string refusal;
  double before_mm = 0, after_mm = 0, seconds = 0;
  std::vector<double> gaps_mm;  // when it ended
};

// Codes that a car with something over an edge may get.
bool names_a_spoilt_edge(std::uint16_t code) {
  constexpr std::array codes{Code::too_few_marks,         Code::deviation_not_attributable,
                             Code::image_saturated,       Code::image_blurred,
                             Code::sigma_too_large,       Code::geometry_degenerate,
                             Code::hidden_error_too_large};
  return std::ranges::find(codes, static_cast<Code>(code)) != codes.end();
}

class GapLog {
 public:
  explicit GapLog(const GapDriveOptions& options) : options_(options) {
    std::printf("\n%4s | %7s | %13s | %12s | %-47s | %6s |\n", "car", "motions", "uneven before",
                "after, truth", "gaps when it ended, truth, mm", "s");
  }

  void add(const Car& car) {
    const bool right = car.even && car.after_mm <= options_.even_within_mm;
    const bool refused = !car.covered.empty() && car.code != 0 && names_a_spoilt_edge(car.code);
    const bool good = right || refused;
    cars_ += 1;
    bad_ += good ? 0 : 1;
    if (refused) refused_ += 1;
    if (car.even) {
      even_ += 1;
      motions_ += car.motions;
      worst_mm_ = std::max(worst_mm_, car.after_mm);
      squares_ += car.after_mm * car.after_mm;
    }
    print(car, good);
  }

  int summary() const {
    std::printf(
        "\n%d cars: %d even, with %.1f motions each, uneven by %.3f mm RMS, %.3f mm at worst; %d with "
        "something over "
        "an edge refused\n",
        cars_, even_, even_ > 0 ? double(motions_) / even_ : 0.0,
        even_ > 0 ? std::sqrt(squares_ / even_) : 0.0, worst_mm_, refused_);
    std::printf("%d not within %g mm and not rightly refused\n", bad_, options_.even_within_mm);
    return cars_ > 0 && bad_ == 0 ? 0 : 1;
  }

 private:
  void print(const Car& car, bool good) const {
    std::printf("%4d | %7d | %13.3f | %12.3f |", cars_, car.motions, car.before_mm, car.after_mm);
    for (const double gap_mm : car.gaps_mm) std::printf(" %7.3f", gap_mm);
    std::printf(" | %6.1f | %s", car.seconds, good ? "ok" : "!!");
    if (!car.even) std::printf(" no motion: %s (code %u)", car.refusal.c_str(), unsigned(car.code));
    for (const std::string& name : car.covered) std::printf("; %s", name.c_str());
    std::printf("\n");
    std::fflush(stdout);
  }

  const GapDriveOptions& options_;
  int cars_ = 0, bad_ = 0, refused_ = 0, even_ = 0, motions_ = 0;
  double worst_mm_ = 0, squares_ = 0;
};

class GapProgram {
 public:
  GapProgram(const Cell& cell, const GapsObject& object, const GapDriven& driven,
             const GapDriveOptions& options, SimulatedRobot& robot)
      : job_(cell.jobs.front()),
        object_(object),
        driven_(driven),
        options_(options),
        robot_(robot),
        random_(options.seed),
        errors_(options.robot, 1, options.seed + 1000) {}

  Car run(int part, const std::atomic<bool>& stop) {
    Car car = arrived(part);
    const auto start = Clock::now();
    car.before_mm = true_unevenness_mm(object_, X_OT(car));
    while (!stop && !one_round(part, car)) continue;
    car.seconds = std::chrono::duration<double>(Clock::now() - start).count();
    car.after_mm = true_unevenness_mm(object_, X_OT(car));
    for (const RimPlace& place : object_.places)
      car.gaps_mm.push_back(true_gap_mm(object_, place, X_OT(car)));
    return car;
  }

 private:
  Pose X_OT(const Car& car) const { return car.X_WO.inverse() * object_.X_WR * car.X_RH_true * object_.X_HT; }

  Car arrived(int part) {
    Car car;
    Vector6 six;
    for (double& component : six) component = random_.uniform(-1, 1);
    six = six.cwiseProduct(options_.shift);
    car.X_WO = object_.X_WR * object_.X_RH * object_.X_HT *
               from_six_numbers({six(0), six(1), six(2), six(3), six(4), six(5)});
    for (double& gain : car.gain) gain = 1 + options_.gain_error * random_.uniform(-1, 1);
    const std::size_t place = static_cast<std::size_t>(random_.uniform() * double(object_.places.size()));
    if (options_.spoilt_every > 0 && part % options_.spoilt_every == 0) {
      constexpr std::array kinds{"dirt", "glint", "hidden", "taped"};
      const std::string kind = kinds[static_cast<std::size_t>(part / options_.spoilt_every) % kinds.size()];
      car.covered.insert(object_.places[place].name + " " + kind + " " + std::to_string(part));
    }
    driven_.show(car.X_WO, car.covered);
    stand(car, object_.X_RH);
    return car;
  }

  void stand(Car& car, const Pose& X_RH) {
    car.X_RH = X_RH;
    car.X_RH_true = errors_.true_hand(0, X_RH);
    driven_.move_hand(object_.robot, car.X_RH_true);
  }

  // True: the car is done.
  bool one_round(int part, Car& car) {
    const RobotAnswer answer =
        robot_.measure(static_cast<std::uint16_t>(job_.number), static_cast<std::uint32_t>(part));
    car.code = answer.code;
    car.refusal = answer.refusal;
    if (!answer.ok() || !answer.correction) return true;
    robot_.acknowledge();
    car.even = is_nothing(*answer.correction);
    if (car.even) return true;
    car.refusal = "not even after the most motions";
    if (car.motions == options_.most_motions) return true;
    car.motions += 1;
    const Pose& X_HT = job_.gaps->X_HT;  // the robot's tool
    stand(car, car.X_RH * X_HT * with_gain(*answer.correction, car.gain) * X_HT.inverse());
    return false;
  }

  const Job& job_;
  const GapsObject& object_;
  const GapDriven& driven_;
  const GapDriveOptions& options_;
  SimulatedRobot& robot_;
  Random random_;
  HandErrors errors_;
};

}  // namespace

int drive_gaps(const Cell& cell, const GapsObject& object, const GapDriven& driven,
               const GapDriveOptions& options, const std::atomic<bool>& stop) {
  SimulatedRobotOptions its = robot_options(cell, object.robot);
  its.max_translation_mm = options.robot_max_mm;
  its.max_rotation_deg = options.robot_max_deg;
  SimulatedRobot robot(its);
  const auto ready = [&robot] {
    const ResultBlock block = robot.read().block;
    return block.state == LinkState::ready && block.has(status_bit::ready);
  };
  if (!done_within(options.ready_within_s, stop, ready)) {
    if (!stop)
      std::fprintf(stderr, "the robot waited %.0f s for the daemon to be ready\n", options.ready_within_s);
    return 1;
  }
  GapProgram program(cell, object, driven, options, robot);
  GapLog log(options);
  for (int part = 1; !stop && (!options.parts || part <= *options.parts); ++part)
    if (const Car car = program.run(part, stop); !stop) log.add(car);
  return log.summary();
}

}  // namespace zeropose
