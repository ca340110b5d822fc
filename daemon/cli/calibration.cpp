#include "daemon/cli/calibration.h"

#include <algorithm>
#include <chrono>
#include <memory>
#include <sstream>

#include "calib/comparison.h"
#include "config/calibration_store.h"
#include "config/camera_file.h"
#include "config/cameras.h"
#include "config/cell.h"
#include "config/files.h"
#include "config/records.h"
#include "config/text.h"
#include "daemon/cli/answer.h"

namespace zeropose {
namespace {

using namespace cli;

constexpr const char* help =
    R"(Calibrating writes files and changes nothing; a cell believes a new calibration from the moment on at which it
is activated here. What was active before is kept beside the calibration file, in FILE.history/, and undo goes
back to it, step by step. activate says what changes and where the camera looks to now; --dry-run says no more.
Afterwards restart the daemon, which goes on with the old calibration until then, and take a new zero measurement: the old
one was made with another calibration, and a restarted daemon gives no robot anything before.
Examples:
  zeropose calibrate points --points p.csv --width 768 --height 572 --output new.json
  zeropose calibration activate --cell cell.json --camera camera1 --from new.json --why "lens exchanged"
  zeropose calibration history --cell cell.json
  zeropose calibration undo --cell cell.json
Exit status: 0 done, 1 there is nothing to go back to, 2 wrong usage, unreadable input, or a calibration that the
cell does not accept.)";

constexpr const char* afterwards =
    "restart the daemon: until then it goes on with the old calibration. Then take a new zero measurement; "
    "before that no robot gets anything";

struct Options {
  std::string cell, camera, from, why;
  bool internals_only = false, dry_run = false, json = false;
};

std::string time_now() { return iso8601_utc(std::chrono::system_clock::now()); }

Json entry_json(const CalibrationEntry& entry, bool active) {
  return {{"number", entry.number}, {"before", entry.before},        {"time", entry.time_utc},
          {"why", entry.why},       {"hash", hash_text(entry.hash)}, {"active", active}};
}

std::string entry_text(const CalibrationEntry& entry, bool active) {
  return concat({active ? "* " : "  ", std::to_string(entry.number), "  ", entry.time_utc, "  ",
                 hash_text(entry.hash), "  ", entry.why, "\n"});
}

Answer history_of(const Options& options) {
  const std::filesystem::path file = calibration_file_of(options.cell);
  const auto active = active_entry(file);
  const std::string hash = hash_text(short_hash(read_file(file)));
  Answer answer;
  answer.json = {
      {"status", "ok"}, {"reason", ""}, {"file", file.string()}, {"hash", hash}, {"entries", Json::array()}};
  for (const CalibrationEntry& entry : calibration_history(file)) {
    const bool now = active && active->number == entry.number;
    answer.json["entries"].push_back(entry_json(entry, now));
    answer.text += entry_text(entry, now);
  }
  if (!active)
    answer.text += concat({"* ", file.string(), "  ", hash, "  put there by hand, not by this command\n"});
  return answer;
}

// The camera of the file in the place of the cell's.
CalibratedCamera replacement(const Options& options, const CalibratedCamera& active) {
  const CameraFile file = load_camera(options.from, active.name);
  if (!file.has_pose && !options.internals_only)
    throw ConfigError({concat({options.from, ": found no pose, expected ", active.on_hand ? "X_HC" : "X_WC",
                               "; with --internals-only the camera keeps the pose it has"})});
  CalibratedCamera camera = file.camera;
  camera.name = active.name;
  if (options.internals_only) camera.X_WC = active.X_WC, camera.on_hand = active.on_hand;
  return camera;
}

struct Change {
  std::string text;  // of the whole file
  CameraComparison comparison;
};

constexpr double comparison_depth_mm = 2000;

Change change_of(const Options& options, const Cell& cell) {
  // All of the file: another cell may use it as well.
  std::vector<CalibratedCamera> cameras =
      parse_cameras(read_file(cell.calibration_file), cell.calibration_file.string());
  const auto active = std::ranges::find(cameras, options.camera, &CalibratedCamera::name);
  if (active == cameras.end()) {
    std::string names;
    for (const CalibratedCamera& camera : cameras) names += concat({names.empty() ? "" : ", ", camera.name});
    throw ConfigError({concat({"--camera: found ", in_quotes(options.camera), ", expected one of ", names})});
  }
  const CalibratedCamera fresh = replacement(options, *active);
  const CameraComparison comparison = compare(*active, fresh, comparison_depth_mm);
  *active = fresh;
  Change change{cameras_text(cameras), comparison};
  parse_cell({read_file(options.cell), options.cell, change.text, options.from});  // throws what does not fit
  return change;
}

Json change_json(const CameraComparison& comparison) {
  return {{"moved_mm", comparison.moved_mm},
          {"turned_deg", comparison.turned_deg},
          {"worst_internals_px", comparison.worst_internals_px},
          {"worst_camera_px", comparison.worst_camera_px},
          {"depth_mm", comparison_depth_mm}};
}

std::string change_text(const CameraComparison& comparison) {
  std::ostringstream text;
  text << "the camera moves by " << comparison.moved_mm << " mm and turns by " << comparison.turned_deg
       << " deg; a point " << comparison_depth_mm << " mm away is seen elsewhere by up to "
       << comparison.worst_camera_px << " px, the lens alone makes up " << comparison.worst_internals_px
       << " px\n";
  return text.str();
}

Answer activate(const Options& options) {
  const Cell cell = load_cell(options.cell);
  const Change change = change_of(options, cell);
  Answer answer;
  answer.json = {{"status", "ok"}, {"reason", ""}, {"change", change_json(change.comparison)}};
  answer.text = change_text(change.comparison);
  if (options.dry_run) return answer;
  const CalibrationEntry entry = activate_calibration(
      cell.calibration_file, change.text, concat({options.camera, ": ", options.why}), time_now());
  answer.json["entry"] = entry_json(entry, true);
  answer.json["remedy"] = afterwards;
  answer.text += concat({entry_text(entry, true), afterwards, "\n"});
  return answer;
}

Answer undo(const Options& options) {
  const std::filesystem::path file = calibration_file_of(options.cell);
  const auto before = entry_before(file);
  if (!before) return failure("there is nothing before the active calibration");
  parse_cell({read_file(options.cell), options.cell, before->text,
              concat({"entry ", std::to_string(before->number)})});
  const CalibrationEntry entry = undo_calibration(file, time_now());
  Answer answer;
  answer.json = {
      {"status", "ok"}, {"reason", ""}, {"entry", entry_json(entry, true)}, {"remedy", afterwards}};
  answer.text = concat({entry_text(entry, true), afterwards, "\n"});
  return answer;
}

cli::Verb subcommand(cli::Verb parent, const std::string& name, const std::string& text,
                     const std::shared_ptr<Options>& options, int& exit_status,
                     Answer (*answer)(const Options&)) {
  const Verb verb = parent.add_subcommand(name, text);
  verb.add_option("--cell", options->cell, "the cell file").required();
  verb.add_flag("--json", options->json, "one JSON object on stdout");
  verb.callback([options, answer, &exit_status] {
    exit_status = run([&] { return answer(*options); }, options->json);
  });
  return verb;
}

}  // namespace

void add_calibration(cli::Verb app, int& exit_status) {
  auto options = std::make_shared<Options>();
  const Verb verb =
      app.add_subcommand("calibration", "Which calibration a cell has; puts a new one in its place");
  verb.require_subcommand();
  verb.footer(help);
  subcommand(verb, "history", "All that were active, the present one with a star", options, exit_status,
             history_of);
  const Verb put = subcommand(verb, "activate", "Puts a camera's new calibration in the place of the old one",
                              options, exit_status, activate);
  put.add_option("--camera", options->camera, "name of the camera in the cell").required();
  put.add_option("--from", options->from, "JSON of the camera as calibrate writes it with --output")
      .required();
  put.add_option("--why", options->why, "what is kept in the history").required();
  put.add_flag("--internals-only", options->internals_only, "the camera keeps the pose it has");
  put.add_flag("--dry-run", options->dry_run, "only say what would change");
  subcommand(verb, "undo", "Goes back to what was active before", options, exit_status, undo);
}

}  // namespace zeropose
