#include "daemon/camera_trial.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <thread>

#include "daemon/cycle.h"

namespace zeropose {
namespace {

using namespace std::chrono_literals;
using std::chrono::steady_clock;

// A line that stops once in a thousand cars stops once a shift.
constexpr double least_answered = 0.999;
constexpr double least_of_rate = 0.95;
// Half of the deadline stays for a busy computer; marks are found in a tenth of it.
constexpr double most_of_deadline = 0.5;
// Objects stand still while they are measured, so this is about the network, not about motion.
constexpr double most_spread_ms = 20;
// Twice it doubles the uncertainty of every mark, which is 0.004 px for a mark of 40 px and contrast 100
// at 2.
constexpr double most_noise_grey = 4;
constexpr double most_saturated =
    0.05;  // lamps and reflections of a few per cent are usual, marks are elsewhere
constexpr double most_dark = 0.95;
constexpr double most_blur_px = 2;  // beyond it small marks lose their contrast

double milliseconds(steady_clock::duration time) {
  return std::chrono::duration<double, std::milli>(time).count();
}

void wait_until_known(const Grabber& grabber, std::chrono::seconds patience) {
  const TimePoint end = steady_clock::now() + patience;
  for (std::size_t i = 0; i < grabber.size(); ++i)
    while (grabber.camera(i).state() != CameraState::alive && steady_clock::now() < end)
      std::this_thread::sleep_for(10ms);
}

// False: nobody wants more frames.
bool run_round(Grabber& grabber, const CameraTrialOptions& options, CameraTrial& trial,
               FrozenPictures& pictures, const OnFrame& on_frame) {
  bool go_on = true;
  std::vector<std::size_t> all(grabber.size());
  std::iota(all.begin(), all.end(), std::size_t{0});
  const TimePoint requested = steady_clock::now();
  const auto results = grabber.grab(all, requested + options.deadline);
  std::vector<Frame> frames;
  for (std::size_t i = 0; i < results.size(); ++i) {
    CameraTrial::Camera& camera = trial.cameras[i];
    ++camera.asked;
    if (results[i].status != GrabStatus::ok) {
      camera.last_problem = results[i].reason;
      continue;
    }
    const Frame& frame = results[i].frame;
    if (grabber.camera(i).camera().driver != CameraDriver::folder && pictures.repeats(i, frame)) {
      camera.last_problem = frame.camera + " delivered the same picture as before, bit for bit";
      continue;
    }
    ++camera.answered;
    camera.latency_ms.push_back(milliseconds(frame.received - requested));
    camera.health.push_back(picture_health(view_of(frame)));
    frames.push_back(frame);
    if (on_frame) go_on = on_frame(frame, camera.latency_ms.back(), camera.health.back()) && go_on;
  }
  if (frames.size() == results.size() && frames.size() > 1)
    trial.spread_ms.push_back(milliseconds(trigger_spread(frames)));
  return go_on;
}

template <class Member>
double median_of(const std::vector<PictureHealth>& health, Member member) {
  std::vector<double> values;
  for (const PictureHealth& picture : health) values.push_back(std::invoke(member, picture));
  return quantile_of(std::move(values), 0.5);
}

void judge_pictures(const CameraTrial::Camera& camera, std::vector<TrialFinding>& findings) {
  const auto at_most = [&](const std::string& what, double found, double wanted, const std::string& remedy) {
    findings.push_back({camera.name, what, found, wanted, found <= wanted, remedy});
  };
  at_most("noise, grey levels", median_of(camera.health, &PictureHealth::noise_grey), most_noise_grey,
          "less gain and more light or exposure");
  at_most("saturated share", median_of(camera.health, &PictureHealth::saturated_share), most_saturated,
          "shorten the exposure, close the iris, shade reflections");
  at_most("dark share", median_of(camera.health, &PictureHealth::dark_share), most_dark,
          "lamp, lens cap, exposure, iris");
  std::vector<double> blur;
  for (const PictureHealth& picture : camera.health)
    if (picture.focus_px) blur.push_back(*picture.focus_px);
  if (blur.empty()) return;  // nothing with an edge in view: no verdict
  at_most("blur of the sharpest edges, px", quantile_of(blur, 0.5), most_blur_px,
          "focus the lens, clean it; does the camera shake?");
}

void judge(const CameraTrialOptions& options, CameraTrial& trial) {
  const double deadline_ms = milliseconds(options.deadline);
  for (const CameraTrial::Camera& camera : trial.cameras) {
    const double answered = camera.asked > 0 ? static_cast<double>(camera.answered) / camera.asked : 0;
    trial.findings.push_back({camera.name, "share of requests answered", answered, least_answered,
                              answered >= least_answered, camera.last_problem});
    if (camera.answered == 0) continue;
    const double p99 = quantile_of(camera.latency_ms, 0.99);
    trial.findings.push_back({camera.name, "latency p99, ms", p99, most_of_deadline * deadline_ms,
                              p99 <= most_of_deadline * deadline_ms,
                              "shorten the exposure; look for load on computer and network"});
    judge_pictures(camera, trial.findings);
  }
  trial.findings.push_back({"", "rounds per second", trial.rate_hz, least_of_rate * options.rate_hz,
                            trial.rate_hz >= least_of_rate * options.rate_hz,
                            "ask for a lower --rate, or look for load on computer and network"});
  if (!trial.spread_ms.empty()) {
    const double spread = quantile_of(trial.spread_ms, 0.99);
    trial.findings.push_back({"", "spread of the triggers p99, ms", spread, most_spread_ms,
                              spread <= most_spread_ms, "look for load on the computer"});
  }
}

}  // namespace

double quantile_of(std::vector<double> values, double share) {
  if (values.empty()) return 0;
  std::sort(values.begin(), values.end());
  return values[static_cast<std::size_t>(std::lround(share * static_cast<double>(values.size() - 1)))];
}

bool CameraTrial::good() const {
  return std::ranges::all_of(findings, [](const TrialFinding& finding) { return finding.good; });
}

CameraTrial try_cameras(const std::vector<CameraOptions>& cameras, const CameraTrialOptions& options,
                        const OnFrame& on_frame) {
  CameraTrial trial;
  for (const CameraOptions& camera : cameras) trial.cameras.emplace_back().name = camera.name;
  Grabber grabber(cameras);
  wait_until_known(grabber, options.patience);
  const auto period = std::chrono::duration_cast<steady_clock::duration>(1s / options.rate_hz);
  const TimePoint begin = steady_clock::now();
  FrozenPictures pictures(cameras.size());
  int rounds = 0;
  bool go_on = true;
  for (TimePoint next = begin; go_on && next < begin + options.duration; next += period) {
    std::this_thread::sleep_until(next);
    go_on = run_round(grabber, options, trial, pictures, on_frame);
    ++rounds;
    next = std::max(next, steady_clock::now() - period);  // a late round makes no hurry
  }
  const double asked_for_ms = go_on ? milliseconds(options.duration) : 0;
  const double seconds = std::max(asked_for_ms, milliseconds(steady_clock::now() - begin)) / 1e3;
  trial.rate_hz = rounds / seconds;
  for (std::size_t i = 0; i < cameras.size(); ++i) {
    trial.cameras[i].statistics = grabber.camera(i).statistics();
    if (trial.cameras[i].last_problem.empty())
      trial.cameras[i].last_problem = grabber.camera(i).last_problem();
  }
  judge(options, trial);
  return trial;
}

}  // namespace zeropose
