#include "sim/survey_drive.h"

#include <cstdio>

#include "measure/code.h"
#include "sim/drive.h"
#include "sim/robot.h"

namespace zeropose {
namespace {

constexpr double begins_within_s = 60;
constexpr int tries = 3;

}  // namespace

Pose survey_position(const SurveyDrive& survey, int position) {
  Pose X_RH = survey.X_RH_first;
  const Eigen::Vector3d steps(position % 3, position / 3 % 3, position / 9);
  const Eigen::Vector3d way = steps.cwiseProduct(survey.step_mm);
  X_RH.translation() += survey.along_hand ? X_RH.linear() * way : way;
  return X_RH;
}

int drive_survey(const Cell& cell, const SurveyDrive& survey,
                 const std::function<void(const CarriedBall&)>& show, const std::atomic<bool>& stop) {
  SimulatedRobot robot(robot_options(cell, survey.robot));
  HandErrors errors(survey.errors, survey_positions, 1);
  const Pose& X_WR = cell.robots.at(survey.robot).X_WR;
  const auto go = [&](int position) {
    const Pose X_RH = survey_position(survey, position);
    const Pose X_RH_true = errors.true_hand(static_cast<std::size_t>(position), X_RH);
    show({X_WR * X_RH_true * survey.p_HT_mm, survey.radius_mm, survey.grey});
    return robot.at_position(static_cast<std::uint16_t>(cell.jobs.front().number), 0, position + 1, X_RH);
  };
  // Somebody looks at the positions, whatever he sees.
  const auto begun = [&] {
    const RobotAnswer answer = go(0);
    return answer.ok() || answer.code == static_cast<std::uint16_t>(Code::not_standing_still) ||
           answer.code == static_cast<std::uint16_t>(Code::too_few_marks);
  };
  if (!done_within(begins_within_s, stop, begun)) {
    std::fprintf(stderr, "the robot waited %.0f s for a survey\n", begins_within_s);
    return 1;
  }
  int taken = 0;
  for (int position = 0; position < survey_positions && !stop; ++position) {
    RobotAnswer answer;
    for (int attempt = 0; attempt < tries && !answer.ok(); ++attempt) answer = go(position);
    taken += answer.ok() ? 1 : 0;
    std::printf("position %2d: %s\n", position + 1, answer.ok() ? "taken" : answer.refusal.c_str());
    std::fflush(stdout);
  }
  std::printf("%d of %d positions taken\n", taken, survey_positions);
  return taken == survey_positions ? 0 : 1;
}

}  // namespace zeropose
