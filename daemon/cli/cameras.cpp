#include "daemon/cli/cameras.h"

#include <algorithm>
#include <fstream>
#include <memory>
#include <optional>
#include <thread>

#include "config/cell.h"
#include "config/text.h"
#include "daemon/cli/answer.h"
#include "daemon/cli/camera_choice.h"
#include "daemon/cli/cameras_run.h"
#include "daemon/cycle.h"
#include "drivers/gige_discovery.h"
#include "drivers/picture_file.h"
#include "drivers/v4l2_discovery.h"

namespace zeropose {
namespace {

using namespace cli;
using namespace std::chrono_literals;
using std::chrono::steady_clock;

constexpr auto open_patience = 15s;  // a device that another program held is free after 3 s

struct ListOptions {
  std::string cell, interface;
  double seconds = 1;
  bool json = false;
};

struct SnapshotOptions : CameraChoice {
  std::string out;
  bool json = false;
};

constexpr const char* list_help =
    R"(GigE Vision cameras are asked for by a broadcast on every network interface; video devices are those of this
computer. Each with the text that a cell file needs, to which width_px and height_px are to be added.
Examples:
  zeropose cameras list
  zeropose cameras list --interface eth1 --json
  zeropose cameras list --cell cell.json
Exit status: 0 done, also when nothing was found; 1 a camera of the cell is not there; 2 wrong usage or an unknown interface.)";

constexpr const char* snapshot_help =
    R"(Opens the camera itself. While a daemon runs, the camera is the daemon's: use zeropose snapshot instead.
Pixels of more than 8 bits are written as 16 bit with their values as they are.
Examples:
  zeropose cameras snapshot --cell cell.json --camera camera1 --out camera1.png
  zeropose cameras snapshot --folder pictures --size 768x572 --out first.png
Exit status: 0 done, 1 no picture, 2 wrong usage or an unreadable cell file.)";

Json gige_json(const FoundGigeCamera& camera) {
  return {{"driver", "gige"},
          {"vendor", camera.vendor},
          {"model", camera.model},
          {"serial", camera.serial},
          {"user_name", camera.user_name},
          {"address", camera.address},
          {"mac", camera.mac},
          {"interface", camera.interface},
          {"cell", {{"driver", "gige"}, {"address", camera.address}, {"serial", camera.serial}}}};
}

Json v4l2_json(const FoundV4l2Camera& camera) {
  const std::string& stable = !camera.by_path.empty() ? camera.by_path : camera.device;
  return {{"driver", "v4l2"},      {"device", camera.device},
          {"card", camera.card},   {"kernel_driver", camera.driver},
          {"bus", camera.bus},     {"by_path", camera.by_path},
          {"by_id", camera.by_id}, {"cell", {{"driver", "v4l2"}, {"device", stable}}}};
}

bool is_among(const CameraOptions& camera, const std::vector<FoundGigeCamera>& found) {
  const auto agrees = [](const std::string& wanted, const std::string& has) {
    return wanted.empty() || wanted == has;
  };
  return std::ranges::any_of(found, [&](const FoundGigeCamera& one) {
    return agrees(camera.gige.address, one.address) && agrees(camera.gige.serial, one.serial) &&
           agrees(camera.gige.user_name, one.user_name);
  });
}

bool is_there(const CameraOptions& camera, const std::vector<FoundGigeCamera>& found) {
  switch (camera.driver) {
    case CameraDriver::gige:
      return is_among(camera, found);
    case CameraDriver::v4l2:
      return std::filesystem::exists(camera.v4l2.device);
    case CameraDriver::folder:
      return std::filesystem::is_directory(camera.folder.path);
  }
  return false;
}

// Adds which cameras of the cell are there; false: some are not.
bool compare_with_cell(const std::string& cell, const std::vector<FoundGigeCamera>& found, Answer& answer) {
  bool all = true;
  answer.json["cell"] = Json::array();
  for (const CameraOptions& camera : load_cell(cell).cameras) {
    const bool there = is_there(camera, found);
    all = all && there;
    answer.json["cell"].push_back({{"camera", camera.name}, {"place", place_of(camera)}, {"found", there}});
    answer.text += concat({title_of(camera), there ? " is there\n" : " was NOT found\n"});
    if (!there)
      answer.json["reason"] = title_of(camera) + " was not found; check its power, cable and address";
  }
  return all;
}

Answer list(const ListOptions& options) {
  Json cameras = Json::array();
  std::string text;
  const auto wait = std::chrono::milliseconds(static_cast<long>(1000 * options.seconds));
  const std::vector<FoundGigeCamera> found = discover_gige(wait, options.interface);
  for (const FoundGigeCamera& camera : found) {
    const Json& json = cameras.emplace_back(gige_json(camera));
    text += concat({camera.address, "  ", camera.vendor, " ", camera.model, ", serial ", camera.serial, ", ",
                    camera.interface, "\n  ", json["cell"].dump(), "\n"});
  }
  for (const FoundV4l2Camera& camera : discover_v4l2()) {
    const Json& json = cameras.emplace_back(v4l2_json(camera));
    text += concat({camera.device, "  ", camera.card, ", ", camera.bus, "\n  ", json["cell"].dump(), "\n"});
  }
  if (cameras.empty()) text = "no camera was found; check power, cables and the interface's address\n";
  Answer answer{done, {{"status", "ok"}, {"reason", ""}, {"cameras", cameras}}, text};
  if (options.cell.empty() || compare_with_cell(options.cell, found, answer)) return answer;
  answer.exit_status = no_answer;
  answer.json["status"] = "failed";
  return answer;
}

Frame one_frame(const CameraOptions& options) {
  const std::unique_ptr<Camera> camera = open_camera(options);
  camera->start();
  camera->trigger();
  std::optional<Frame> frame = camera->grab(steady_clock::now() + open_patience);
  camera->stop();
  if (!frame) throw DeviceError(title_of(options) + ": no frame within 15 s; check its trigger and exposure");
  return *std::move(frame);
}

Answer snapshot(const SnapshotOptions& options) {
  const CameraOptions camera = chosen_camera(options);
  Frame frame;
  try {
    frame = one_frame(camera);
  } catch (const DeviceError& error) {
    std::string reason = error.what();
    if (error.fault() == DeviceFault::in_use)
      reason += "; if zeroposed runs, use zeropose snapshot, which asks it";
    return failure(reason);
  }
  write_png(options.out, frame);
  const PictureHealth health = picture_health(view_of(frame));
  Json json{{"status", "ok"},
            {"reason", ""},
            {"file", options.out},
            {"width_px", frame.width_px},
            {"height_px", frame.height_px},
            {"white", frame.white},
            {"health", health_json(health)}};
  return {done, json, concat({options.out, "\n  ", health_text(health), "\n"})};
}

void add_list(cli::Verb cameras, int& exit_status) {
  auto options = std::make_shared<ListOptions>();
  const Verb verb = cameras.add_subcommand("list", "The cameras that can be reached from here");
  verb.add_option("--cell", options->cell, "also says which cameras of this cell file are there");
  verb.add_option("--interface", options->interface, "only this network interface");
  verb.add_option("--seconds", options->seconds, "to wait for answers (1)").range(0.05, 60.0);
  verb.add_flag("--json", options->json,
                "one JSON object on stdout: status, reason, cameras [{driver, ..., cell}], "
                "cell [{camera, place, found}]");
  verb.footer(list_help);
  verb.callback(
      [options, &exit_status] { exit_status = run([&] { return list(*options); }, options->json); });
}

void add_snapshot(cli::Verb cameras, int& exit_status) {
  auto options = std::make_shared<SnapshotOptions>();
  const Verb verb = cameras.add_subcommand("snapshot", "One picture of a camera, without a daemon");
  add_choice(verb, *options);
  verb.add_option("--out", options->out, "the PNG file to write").required();
  verb.add_flag("--json", options->json,
                "one JSON object on stdout: status, reason, file, width_px, height_px, white, health");
  verb.footer(snapshot_help);
  verb.callback(
      [options, &exit_status] { exit_status = run([&] { return snapshot(*options); }, options->json); });
}

}  // namespace

void add_cameras(cli::Verb app, int& exit_status) {
  const Verb cameras =
      app.add_subcommand("cameras", "Cameras without a daemon: list, snapshot, stream, test");
  cameras.require_subcommand();
  add_list(cameras, exit_status);
  add_snapshot(cameras, exit_status);
  add_cameras_run(cameras, exit_status);
}

}  // namespace zeropose
