// What the cycle does with the positions that robots tell.
#include <spdlog/spdlog.h>

#include <algorithm>
#include <array>
#include <iterator>

#include "daemon/cycle.h"

namespace zeropose {
namespace {

using Clock = std::chrono::steady_clock;

constexpr std::chrono::seconds forgotten_after{30}, driven_forgotten_after{10};
constexpr std::uint32_t zero_part = 0;  // as Zero has it: of several rounds

}  // namespace

void Cycle::end_forgotten_survey() {
  if (!survey_.survey) return;
  const auto patience = survey_.survey->options().targets.empty() ? forgotten_after : driven_forgotten_after;
  if (Clock::now() - survey_asked_.load() <= patience) return;
  spdlog::warn("the survey ends: nobody asked for it for {} s", patience.count());
  forget_survey();
}

void Cycle::forget_survey() {
  survey_ = {survey_.number, {}, {}, {}};
  show_target(0);
}

void Cycle::show_target(int after) {
  const auto& survey = survey_.survey;
  const bool drives = survey && !survey->options().targets.empty();
  const int next = drives ? survey->next_after(after) : 0;
  for (std::size_t robot = 0; robot < links_.size(); ++robot) {
    const bool goes = next > 0 && robot == survey->options().robot;
    links_[robot]->show_target(
        goes ? static_cast<std::uint32_t>(next) : 0,
        goes ? survey->options().targets[static_cast<std::size_t>(next - 1)] : Pose::Identity());
  }
}

Code Cycle::at_position(const Request& request) {
  const bool surveys = survey_.survey && survey_.robot.value_or(request.robot) == request.robot;
  const Told told = surveys ? told_survey(request) : look_from_hand(request);
  spdlog::info("{} request {}: position {} of part {}: code {} {}{}", cell_.robots.at(request.robot).name,
               request.id, request.argument, request.part, static_cast<int>(told.code),
               text_of(told.code).name, told.reason.empty() ? "" : " (" + told.reason + ")");
  if (surveys) {
    survey_.last_problem = told.reason;
    show_target(request.argument);
  }
  return told.code;
}

Cycle::Told Cycle::look_from_hand(const Request& request) {
  const Job& job = cell_.jobs[selected_];
  Standing standing = standing_of(cell_, job, request);
  if (standing.code != Code::ok) {
    hands_.forget();  // a tour that goes wrong begins anew
    return {standing.code, std::move(standing.reason)};
  }
  const auto oldest = Clock::now() - std::chrono::duration_cast<Clock::duration>(
                                         std::chrono::duration<double>(job.positions_within_s));
  const int rounds = request.part == zero_part ? cell_.zero_frames : 1;
  hands_.make_room(standing.position, request.part, request.X_RH, oldest, static_cast<std::size_t>(rounds));
  const FrameSet grabbed = grab_for(request, job.positions[standing.position].cameras);
  if (grabbed.code == Code::ok) hands_.take(standing.position, grabbed.frames);
  return {grabbed.code, grabbed.reason};
}

// With the patience of a measurement: the deadline of a position is longer than the watchdog's.
FrameSet Cycle::grab_for(const Request& request, std::span<const std::size_t> cameras) {
  last_progress_ = Clock::now();
  return grabber_.grab_live(cameras,
                            std::min(request.deadline - compute_reserve, Clock::now() + cell_.deadline));
}

// A survey goes on whatever happens at one position.
Cycle::Told Cycle::told_survey(const Request& request) {
  try {
    return look_for_survey(request);
  } catch (const std::exception& error) {
    return {Code::internal, error.what()};
  }
}

Cycle::Told Cycle::look_for_survey(const Request& request) {
  survey_.robot = request.robot;
  std::vector<std::size_t> cameras;
  for (const SurveyCamera& camera : survey_.survey->options().cameras) cameras.push_back(camera.index);
  std::array<std::vector<Frame>, 2> frames;
  std::array<std::vector<ImageView>, 2> images;
  for (std::size_t picture = 0; picture < frames.size() && !cameras.empty(); ++picture) {
    FrameSet grabbed = grab_for(request, cameras);
    if (grabbed.code != Code::ok) return {grabbed.code, std::move(grabbed.reason)};
    frames[picture] = std::move(grabbed.frames);
    std::ranges::transform(frames[picture], std::back_inserter(images[picture]), view_of);
  }
  last_progress_ = Clock::now();
  SurveyVerdict verdict = survey_.survey->look(request.argument, request.X_RH, images[0], images[1]);
  return {verdict.code, std::move(verdict.reason)};
}

std::uint64_t Cycle::start_survey(const SurveyOptions& options) {
  survey_asked_ = Clock::now();
  return run_between<std::uint64_t>([this, options] {
    hands_.forget();
    const bool drives = !options.targets.empty();
    survey_ = {survey_.number + 1, Survey(options), {}, drives ? std::optional(options.robot) : std::nullopt};
    show_target(0);
    return survey_.number;
  });
}

SurveyState Cycle::survey_now() {
  survey_asked_ = Clock::now();
  return run_between<SurveyState>([this] { return survey_; });
}

void Cycle::end_survey(std::uint64_t number) {
  run_between<bool>([this, number] {
    if (survey_.number != number) return false;
    forget_survey();
    return true;
  });
}

}  // namespace zeropose
