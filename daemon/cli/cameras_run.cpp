#include "daemon/cli/cameras_run.h"

#include <filesystem>
#include <memory>
#include <stdexcept>

#include "config/cell.h"
#include "config/text.h"
#include "daemon/camera_trial.h"
#include "daemon/cli/answer.h"
#include "daemon/cli/camera_choice.h"

namespace zeropose {
namespace {

using namespace cli;
using std::chrono::milliseconds;

constexpr const char* stream_help =
    R"(One line per frame: number, milliseconds from request to pixels, and its health. --save writes them so that a
folder camera replays them in this order.
Examples:
  zeropose cameras stream --cell cell.json --camera camera1 --seconds 10
  zeropose cameras stream --address 192.168.10.11 --size 768x572 --frames 20 --save pictures
Exit status: 0 every request was answered, 1 some were not, 2 wrong usage or an unreadable cell file.)";

constexpr const char* test_help =
    R"(Asks the cameras of a cell together, again and again, and says of rate, loss, latency, spread of the triggers, noise,
saturation and sharpness what was found, what is wanted and what to do. No daemon may hold the cameras.
Examples:
  zeropose cameras test --cell cell.json --minutes 10
  zeropose cameras test --cell cell.json --camera camera1 --camera camera2 --seconds 30 --rate 10
Exit status: 0 all is good, 1 something is not, 2 wrong usage or an unreadable cell file.)";

struct StreamOptions : CameraChoice {
  double seconds = 10, rate_hz = 1000;
  int frames = 0;  // 0: as many as come
  std::string save;
  bool json = false;
};

struct TestOptions {
  std::string cell;
  std::vector<std::string> cameras;
  double seconds = 0, minutes = 1, rate_hz = 5;
  bool json = false;
};

milliseconds seconds_of(double seconds) { return milliseconds(static_cast<long>(1e3 * seconds)); }

std::string number(double value, int digits = 2) {
  std::ostringstream text;
  text << std::fixed << std::setprecision(digits) << value;
  return text.str();
}

Json counted_json(const CameraTrial::Camera& camera) {
  const CameraStatistics& counted = camera.statistics;
  return {{"camera", camera.name},
          {"asked", camera.asked},
          {"answered", camera.answered},
          {"timeouts", counted.timeouts},
          {"damaged", counted.damaged},
          {"wrong_size", counted.wrong_size},
          {"stale", counted.stale},
          {"skipped", counted.skipped},
          {"resent_packets", counted.resent_packets},
          {"underruns", counted.underruns},
          {"latency_median_ms", quantile_of(camera.latency_ms, 0.5)},
          {"latency_p99_ms", quantile_of(camera.latency_ms, 0.99)},
          {"latency_max_ms", quantile_of(camera.latency_ms, 1)},
          {"last_problem", camera.last_problem}};
}

std::filesystem::path numbered(const std::string& folder, int frame) {
  std::ostringstream name;
  name << "frame" << std::setfill('0') << std::setw(6) << frame << ".png";
  return std::filesystem::path(folder) / name.str();
}

// One of its own: what lies in a folder is replayed as one stream.
void make_folder_for_frames(const std::string& folder) {
  std::filesystem::create_directories(folder);
  if (!std::filesystem::is_empty(folder))
    throw std::invalid_argument(folder +
                                ": there are files in it, and the frames would be replayed among them: "
                                "name a new folder");
}

Answer stream(const StreamOptions& options) {
  const CameraOptions camera = chosen_camera(options);
  if (!options.save.empty()) make_folder_for_frames(options.save);
  CameraTrialOptions trial_options;
  trial_options.duration = seconds_of(options.seconds);
  trial_options.rate_hz = options.rate_hz;
  int frames = 0;
  const auto on_frame = [&](const Frame& frame, double latency_ms, const PictureHealth& health) {
    ++frames;
    if (!options.save.empty()) write_png(numbered(options.save, frames).string(), frame);
    if (!options.json)
      std::cout << frames << "  " << number(latency_ms, 1) << " ms  " << frame.width_px << "x"
                << frame.height_px << "  " << health_text(health) << '\n';
    return options.frames == 0 || frames < options.frames;
  };
  const CameraTrial trial = try_cameras({camera}, trial_options, on_frame);
  const CameraTrial::Camera& counted = trial.cameras.front();
  const bool all = counted.answered == counted.asked && counted.answered > 0;
  Json json{{"status", all ? "ok" : "failed"}, {"reason", all ? "" : counted.last_problem}};
  json["rate_hz"] = trial.rate_hz;
  json["frames"] = counted_json(counted);
  const std::string text = concat({std::to_string(counted.answered), " of ", std::to_string(counted.asked),
                                   " requests answered, ", number(trial.rate_hz, 1), " per second",
                                   all ? "" : "; last problem: " + counted.last_problem, "\n"});
  return {all ? done : no_answer, json, text};
}

std::vector<CameraOptions> cameras_of(const TestOptions& options) {
  const Cell cell = load_cell(options.cell);
  if (options.cameras.empty()) return cell.cameras;
  std::vector<CameraOptions> chosen;
  for (const std::string& name : options.cameras)
    chosen.push_back(chosen_camera({options.cell, name, {}, {}, {}, {}}));
  return chosen;
}

std::string finding_text(const TrialFinding& finding) {
  const bool least = finding.what.starts_with("share of requests") || finding.what.starts_with("rounds");
  return concat({finding.good ? "  good  " : "  BAD   ", finding.camera, finding.camera.empty() ? "" : ": ",
                 finding.what, " ", number(finding.found, 3), least ? ", at least " : ", at most ",
                 number(finding.wanted, 3), finding.good ? "" : "\n        do: " + finding.remedy, "\n"});
}

Answer test(const TestOptions& options) {
  CameraTrialOptions trial_options;
  trial_options.duration = seconds_of(options.seconds > 0 ? options.seconds : 60 * options.minutes);
  trial_options.rate_hz = options.rate_hz;
  trial_options.deadline = load_cell(options.cell).deadline;
  const CameraTrial trial = try_cameras(cameras_of(options), trial_options);
  const bool good = trial.good();
  Json findings = Json::array(), cameras = Json::array();
  std::string text = good ? "good\n" : "NOT GOOD\n", reason;
  for (const TrialFinding& finding : trial.findings) {
    findings.push_back({{"camera", finding.camera},
                        {"what", finding.what},
                        {"found", finding.found},
                        {"wanted", finding.wanted},
                        {"good", finding.good},
                        {"remedy", finding.good ? "" : finding.remedy}});
    text += finding_text(finding);
    if (!finding.good && reason.empty())
      reason = concat({finding.camera, ": ", finding.what, ": ", finding.remedy});
  }
  for (const CameraTrial::Camera& camera : trial.cameras) cameras.push_back(counted_json(camera));
  const Json json{
      {"status", good ? "ok" : "failed"}, {"reason", reason}, {"findings", findings}, {"cameras", cameras}};
  return {good ? done : no_answer, json, text};
}

void add_stream(cli::Verb cameras, int& exit_status) {
  auto options = std::make_shared<StreamOptions>();
  const Verb verb = cameras.add_subcommand("stream", "Frames of a camera as they come, without a daemon");
  add_choice(verb, *options);
  verb.add_option("--seconds", options->seconds, "how long (10)").range(0.1, 1e6);
  verb.add_option("--frames", options->frames, "or until so many frames have come").range(1, 1000000000);
  verb.add_option("--rate", options->rate_hz, "requests per second; without it as fast as frames come")
      .range(0.01, 1000.0);
  verb.add_option("--save", options->save, "a folder for the frames as PNG; made if it is not there");
  verb.add_flag("--json", options->json, "one JSON object on stdout: status, reason, rate_hz, frames {...}");
  verb.footer(stream_help);
  verb.callback(
      [options, &exit_status] { exit_status = run([&] { return stream(*options); }, options->json); });
}

void add_test(cli::Verb cameras, int& exit_status) {
  auto options = std::make_shared<TestOptions>();
  const Verb verb =
      cameras.add_subcommand("test", "Whether the cameras of a cell will do, after some minutes of work");
  verb.add_option("--cell", options->cell, "the cell file").required();
  verb.add_option("--camera", options->cameras, "only this one; again for more");
  verb.add_option("--minutes", options->minutes, "how long (1)").range(0.01, 1e5);
  verb.add_option("--seconds", options->seconds, "how long, instead of --minutes").range(0.1, 1e7);
  verb.add_option("--rate", options->rate_hz, "rounds per second (5)").range(0.01, 1000.0);
  verb.add_flag(
      "--json", options->json,
      "one JSON object on stdout: status, reason, findings [{camera, what, found, wanted, good, remedy}], "
      "cameras [{camera, asked, answered, ...}]");
  verb.footer(test_help);
  verb.callback(
      [options, &exit_status] { exit_status = run([&] { return test(*options); }, options->json); });
}

}  // namespace

void add_cameras_run(cli::Verb cameras, int& exit_status) {
  add_stream(cameras, exit_status);
  add_test(cameras, exit_status);
}

}  // namespace zeropose
