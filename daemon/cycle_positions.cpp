// What the cycle does with the positions that robots tell.
#include <spdlog/spdlog.h>

#include "daemon/cycle.h"

namespace zeropose {

namespace {

using Clock = std::chrono::steady_clock;

constexpr std::chrono::seconds forgotten_after{30};

}  // namespace

Code Cycle::at_position(const Request& request) {
  if (survey_.survey && Clock::now() - survey_.asked > forgotten_after) {
    spdlog::warn("the survey ends: nobody asked for it for {} s", forgotten_after.count());
    survey_ = {};
  }
  const Told told = survey_.survey ? look_for_survey(request) : look_from_hand(request);
  spdlog::info("{} request {}: position {} of part {}: code {} {}{}", cell_.robots.at(request.robot).name,
               request.id, request.argument, request.part, static_cast<int>(told.code),
               text_of(told.code).name, told.reason.empty() ? "" : " (" + told.reason + ")");
  if (survey_.survey) survey_.last_problem = told.reason;
  return told.code;
}

Cycle::Told Cycle::look_from_hand(const Request& request) {
  const Job& job = cell_.jobs[selected_];
  Standing standing = standing_of(cell_, job, request);
  if (standing.code != Code::ok) return {standing.code, std::move(standing.reason)};
  const std::size_t camera[] = {job.positions[standing.position].camera};
  FrameSet grabbed = grabber_.grab_live(camera, request.deadline - compute_reserve);
  if (grabbed.code == Code::ok)
    hands_.take(standing.position, request.part, request.X_RH, grabbed.frames.front(),
                static_cast<std::size_t>(cell_.zero_frames));
  return {grabbed.code, std::move(grabbed.reason)};
}

Cycle::Told Cycle::look_for_survey(const Request& request) {
  const std::size_t camera[] = {survey_.survey->options().camera};
  std::vector<Frame> frames;
  for (int picture = 0; picture < 2; ++picture) {
    FrameSet grabbed = grabber_.grab_live(camera, request.deadline - compute_reserve);
    if (grabbed.code != Code::ok) return {grabbed.code, std::move(grabbed.reason)};
    frames.push_back(std::move(grabbed.frames.front()));
  }
  SurveyVerdict verdict =
      survey_.survey->look(request.argument, request.X_RH, view_of(frames[0]), view_of(frames[1]));
  return {verdict.code, std::move(verdict.reason)};
}

void Cycle::start_survey(const SurveyOptions& options) {
  run_between<bool>([this, options] { return survey_ = {Survey(options), {}, Clock::now()}, true; });
}

SurveyState Cycle::survey_now() {
  return run_between<SurveyState>([this] {
    survey_.asked = Clock::now();
    return survey_;
  });
}

void Cycle::end_survey() {
  run_between<bool>([this] { return survey_ = {}, true; });
}

}  // namespace zeropose
