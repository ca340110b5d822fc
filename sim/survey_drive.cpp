#include "sim/survey_drive.h"

#include <algorithm>
#include <cstdio>
#include <stdexcept>

#include "measure/code.h"
#include "sim/drive.h"
#include "sim/robot.h"

namespace zeropose {
namespace {

constexpr double begins_within_s = 60;
constexpr int tries = 3;
// The robot's own space: no target is farther from its first place than its own others are, and this.
constexpr double room_mm = 50;
// A survey's positions are none of a job's; while nobody surveys they are refused.
constexpr std::uint16_t no_job = 0;

Carried carried_by(const BallInHand& ball, const Pose& X_WH) {
  return CarriedBall{X_WH * ball.p_HT_mm, ball.radius_mm, ball.grey};
}
Carried carried_by(const BallInWorld& ball, const Pose&) {
  return CarriedBall{ball.p_W_mm, ball.radius_mm, ball.grey};
}
Carried carried_by(const ShownBody& body, const Pose& X_WH) {
  return CarriedBody{body.X_HB ? Pose(X_WH * *body.X_HB) : body.X_WB, body.marks};
}

// Throws std::invalid_argument.
std::size_t job_named(const Cell& cell, const std::string& name) {
  const auto job = std::ranges::find(cell.jobs, name, &Job::name);
  if (job == cell.jobs.end()) throw std::invalid_argument("the cell has no job " + name);
  return static_cast<std::size_t>(job - cell.jobs.begin());
}

class Surveyor {
 public:
  Surveyor(const Cell& cell, const SurveyDrive& survey, const SurveyedCell& surveyed)
      : cell_(cell),
        survey_(survey),
        surveyed_(surveyed),
        robot_(robot_options(cell, survey.robot)),
        errors_(survey.errors, survey.places.size(), 1) {}

  std::size_t size() const { return survey_.places.size(); }
  std::optional<HandTarget> target() { return robot_.target(); }

  RobotAnswer go(std::size_t position) { return go(position, survey_.places.at(position)); }
  RobotAnswer go(const HandTarget& target) {
    if (target.index <= size() && way_mm(target.X_RH) <= reach_mm()) return go(target.index - 1, target.X_RH);
    RobotAnswer answer;
    answer.refusal = "target " + std::to_string(target.index) + " is outside the robot's own space";
    return answer;
  }

 private:
  double way_mm(const Pose& X_RH) const {
    return (X_RH.translation() - survey_.places.front().translation()).norm();
  }
  double reach_mm() const {
    double reach_mm = 0;
    for (const Pose& X_RH : survey_.places) reach_mm = std::max(reach_mm, way_mm(X_RH));
    return reach_mm + room_mm;
  }

  RobotAnswer go(std::size_t position, const Pose& X_RH) {
    const Pose X_RH_true = errors_.true_hand(position, X_RH);
    const Pose X_WH = cell_.robots.at(survey_.robot).X_WR * X_RH_true;
    surveyed_.move_hand(survey_.robot, X_RH_true);
    std::visit([&](const auto& target) { show(target, X_WH); }, survey_.target);
    return robot_.at_position(no_job, 0, static_cast<std::int32_t>(position + 1), X_RH);
  }

  void show(const StandingObject& object, const Pose&) {
    surveyed_.show_object(job_named(cell_, object.job));
  }
  void show(const TouchedTip&, const Pose&) {}
  template <typename Target>
  void show(const Target& target, const Pose& X_WH) {
    surveyed_.show(carried_by(target, X_WH));
  }

  const Cell& cell_;
  const SurveyDrive& survey_;
  const SurveyedCell& surveyed_;
  SimulatedRobot robot_;
  HandErrors errors_;
};

void tell(std::size_t position, const RobotAnswer& answer) {
  std::printf("position %2zu: %s\n", position, answer.ok() ? "taken" : answer.refusal.c_str());
  std::fflush(stdout);
}

// How many of its own places were taken.
std::size_t through_places(Surveyor& surveyor, const std::atomic<bool>& stop) {
  std::size_t taken = 0;
  for (std::size_t position = 0; position < surveyor.size() && !stop; ++position) {
    RobotAnswer answer;
    for (int attempt = 0; attempt < tries && !answer.ok(); ++attempt) answer = surveyor.go(position);
    taken += answer.ok() ? 1 : 0;
    tell(position + 1, answer);
  }
  return taken;
}

// The daemon shows one target after the other until it has them all; a target outside the robot's space ends
// it.
std::size_t through_targets(Surveyor& surveyor, const std::atomic<bool>& stop) {
  std::size_t taken = 0;
  for (std::size_t go = 0; go < tries * surveyor.size() && !stop; ++go) {
    const std::optional<HandTarget> target = surveyor.target();
    if (!target) break;
    const RobotAnswer answer = surveyor.go(*target);
    taken += answer.ok() ? 1 : 0;
    tell(target->index, answer);
    if (answer.request_id == 0) break;
  }
  return taken;
}

}  // namespace

int drive_survey(const Cell& cell, const SurveyDrive& survey, const SurveyedCell& surveyed,
                 const std::atomic<bool>& stop) {
  Surveyor surveyor(cell, survey, surveyed);
  bool told = false;
  // Somebody surveys, whatever he sees.
  const auto begun = [&] {
    told = surveyor.target().has_value();
    if (told) return true;
    const RobotAnswer answer = surveyor.go(0);
    return answer.ok() || answer.code == static_cast<std::uint16_t>(Code::not_standing_still) ||
           answer.code == static_cast<std::uint16_t>(Code::too_few_marks);
  };
  if (!done_within(begins_within_s, stop, begun)) {
    std::fprintf(stderr, "the robot waited %.0f s for a survey\n", begins_within_s);
    return 1;
  }
  const std::size_t taken = told ? through_targets(surveyor, stop) : through_places(surveyor, stop);
  std::printf("%zu of %zu positions taken\n", taken, surveyor.size());
  return taken == surveyor.size() ? 0 : 1;
}

}  // namespace zeropose
