#include "sim/survey_drive.h"

#include <cstdio>

#include "calib/robot_poses.h"
#include "measure/code.h"
#include "sim/drive.h"
#include "sim/robot.h"

namespace zeropose {
namespace {

constexpr double begins_within_s = 60;
constexpr int tries = 3;
// The robot's own space: no target is farther from its first position than its own grid reaches, and this.
constexpr double room_mm = 50;

class BallCarrier {
 public:
  BallCarrier(const Cell& cell, const SurveyDrive& survey,
              const std::function<void(const CarriedBall&)>& show)
      : cell_(cell),
        survey_(survey),
        show_(show),
        grid_(ball_grid(survey.X_RH_first, survey.step_mm, survey.along_hand)),
        robot_(robot_options(cell, survey.robot)),
        errors_(survey.errors, grid_.size(), 1) {}

  std::size_t size() const { return grid_.size(); }
  std::optional<HandTarget> target() { return robot_.target(); }

  RobotAnswer go(std::size_t position) { return go(position, grid_.at(position)); }
  RobotAnswer go(const HandTarget& target) {
    const double way_mm = (target.X_RH.translation() - grid_.front().translation()).norm();
    const double reach_mm = (grid_.back().translation() - grid_.front().translation()).norm() + room_mm;
    if (way_mm <= reach_mm && target.index <= grid_.size()) return go(target.index - 1, target.X_RH);
    RobotAnswer answer;
    answer.refusal = "target " + std::to_string(target.index) + " is outside the robot's own space";
    return answer;
  }

 private:
  RobotAnswer go(std::size_t position, const Pose& X_RH) {
    const Pose X_RH_true = errors_.true_hand(position, X_RH);
    const Pose& X_WR = cell_.robots.at(survey_.robot).X_WR;
    show_({X_WR * X_RH_true * survey_.p_HT_mm, survey_.radius_mm, survey_.grey});
    return robot_.at_position(static_cast<std::uint16_t>(cell_.jobs.front().number), 0,
                              static_cast<std::int32_t>(position + 1), X_RH);
  }

  const Cell& cell_;
  const SurveyDrive& survey_;
  const std::function<void(const CarriedBall&)>& show_;
  const std::vector<Pose> grid_;
  SimulatedRobot robot_;
  HandErrors errors_;
};

void tell(std::size_t position, const RobotAnswer& answer) {
  std::printf("position %2zu: %s\n", position, answer.ok() ? "taken" : answer.refusal.c_str());
  std::fflush(stdout);
}

// How many positions of its own grid were taken.
std::size_t through_grid(BallCarrier& carrier, const std::atomic<bool>& stop) {
  std::size_t taken = 0;
  for (std::size_t position = 0; position < carrier.size() && !stop; ++position) {
    RobotAnswer answer;
    for (int attempt = 0; attempt < tries && !answer.ok(); ++attempt) answer = carrier.go(position);
    taken += answer.ok() ? 1 : 0;
    tell(position + 1, answer);
  }
  return taken;
}

// The daemon shows one target after the other until it has them all; a target outside the robot's space ends
// it.
std::size_t through_targets(BallCarrier& carrier, const std::atomic<bool>& stop) {
  std::size_t taken = 0;
  for (std::size_t go = 0; go < tries * carrier.size() && !stop; ++go) {
    const std::optional<HandTarget> target = carrier.target();
    if (!target) break;
    const RobotAnswer answer = carrier.go(*target);
    taken += answer.ok() ? 1 : 0;
    tell(target->index, answer);
    if (answer.request_id == 0) break;
  }
  return taken;
}

}  // namespace

int drive_survey(const Cell& cell, const SurveyDrive& survey,
                 const std::function<void(const CarriedBall&)>& show, const std::atomic<bool>& stop) {
  BallCarrier carrier(cell, survey, show);
  bool told = false;
  // Somebody looks at the positions, whatever he sees.
  const auto begun = [&] {
    told = carrier.target().has_value();
    if (told) return true;
    const RobotAnswer answer = carrier.go(0);
    return answer.ok() || answer.code == static_cast<std::uint16_t>(Code::not_standing_still) ||
           answer.code == static_cast<std::uint16_t>(Code::too_few_marks);
  };
  if (!done_within(begins_within_s, stop, begun)) {
    std::fprintf(stderr, "the robot waited %.0f s for a survey\n", begins_within_s);
    return 1;
  }
  const std::size_t taken = told ? through_targets(carrier, stop) : through_grid(carrier, stop);
  std::printf("%zu of %zu positions taken\n", taken, carrier.size());
  return taken == carrier.size() ? 0 : 1;
}

}  // namespace zeropose
