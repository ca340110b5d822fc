#include "daemon/cli_cameras.h"

#include <algorithm>
#include <fstream>
#include <memory>
#include <optional>
#include <thread>

#include "config/cell.h"
#include "config/text.h"
#include "daemon/cli_answer.h"
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

struct Options {
  std::string cell, camera, address, device, folder, interface, out;
  std::vector<int> size;
  double seconds = 1;
  bool json = false;
};

constexpr const char* list_help =
    R"(GigE Vision cameras are asked for by a broadcast on every network interface; video devices are those of this
computer. Each with the text that a cell file needs, to which width_px and height_px are to be added.
Examples:
  zeropose cameras list
  zeropose cameras list --interface eth1 --json
Exit status: 0 done, also when nothing was found, 2 wrong usage or an unknown interface.)";

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

Answer list(const Options& options) {
  Json cameras = Json::array();
  std::string text;
  const auto wait = std::chrono::milliseconds(static_cast<long>(1000 * options.seconds));
  for (const FoundGigeCamera& camera : discover_gige(wait, options.interface)) {
    const Json& json = cameras.emplace_back(gige_json(camera));
    text += concat({camera.address, "  ", camera.vendor, " ", camera.model, ", serial ", camera.serial, ", ",
                    camera.interface, "\n  ", json["cell"].dump(), "\n"});
  }
  for (const FoundV4l2Camera& camera : discover_v4l2()) {
    const Json& json = cameras.emplace_back(v4l2_json(camera));
    text += concat({camera.device, "  ", camera.card, ", ", camera.bus, "\n  ", json["cell"].dump(), "\n"});
  }
  if (cameras.empty()) text = "no camera was found; check power, cables and the interface's address\n";
  return {done, {{"status", "ok"}, {"reason", ""}, {"cameras", cameras}}, text};
}

CameraOptions of_cell(const Options& options) {
  const Cell cell = load_cell(options.cell);
  const auto camera = std::ranges::find(cell.cameras, options.camera, &CameraOptions::name);
  if (camera == cell.cameras.end())
    throw std::invalid_argument(
        concat({options.cell, ": has no camera \"", options.camera, "\"; name one by --camera"}));
  return *camera;
}

CameraOptions wanted(const Options& options) {
  if (!options.cell.empty()) return of_cell(options);
  CameraOptions camera;
  camera.name = "camera";
  if (options.size.size() != 2)
    throw std::invalid_argument("without --cell the picture's --size WIDTHxHEIGHT is needed");
  camera.width_px = options.size[0];
  camera.height_px = options.size[1];
  camera.gige.address = options.address;
  camera.v4l2.device = options.device;
  camera.folder.path = options.folder;
  if (!options.device.empty()) camera.driver = CameraDriver::v4l2;
  if (!options.folder.empty()) camera.driver = CameraDriver::folder;
  if (place_of(camera).empty())
    throw std::invalid_argument("which camera? Give --cell and --camera, --address, --device or --folder");
  return camera;
}

Json health_json(const PictureHealth& health) {
  return {{"noise_grey", health.noise_grey},
          {"saturated_share", health.saturated_share},
          {"dark_share", health.dark_share},
          {"mean_grey", health.mean_grey},
          {"focus_px", health.focus_px ? Json(*health.focus_px) : Json()}};
}

std::string health_text(const PictureHealth& health) {
  std::ostringstream text;
  text << std::fixed << std::setprecision(2) << "mean " << health.mean_grey << " grey, noise "
       << health.noise_grey << ", saturated " << 100 * health.saturated_share << " %, dark "
       << 100 * health.dark_share << " %, focus ";
  if (health.focus_px)
    text << *health.focus_px << " px";
  else
    text << "unknown: no edge in the picture";
  return text.str();
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

void write_png(const std::string& path, const Frame& frame) {
  const std::vector<std::uint8_t> png = encode_png(frame);
  std::ofstream file(path, std::ios::binary);
  file.write(reinterpret_cast<const char*>(png.data()), static_cast<std::streamsize>(png.size()));
  file.close();
  if (!file) throw std::runtime_error(concat({path, ": cannot be written"}));
}

Answer snapshot(const Options& options) {
  const CameraOptions camera = wanted(options);
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

void add_list(CLI::App& cameras, int& exit_status) {
  auto options = std::make_shared<Options>();
  CLI::App* verb = cameras.add_subcommand("list", "The cameras that can be reached from here");
  verb->add_option("--interface", options->interface, "only this network interface");
  verb->add_option("--seconds", options->seconds, "to wait for answers (1)")->check(CLI::Range(0.05, 60.0));
  verb->add_flag("--json", options->json,
                 "one JSON object on stdout: status, reason, cameras [{driver, ..., cell}]");
  verb->footer(list_help);
  verb->callback(
      [options, &exit_status] { exit_status = run([&] { return list(*options); }, options->json); });
}

void add_snapshot(CLI::App& cameras, int& exit_status) {
  auto options = std::make_shared<Options>();
  CLI::App* verb = cameras.add_subcommand("snapshot", "One picture of a camera, without a daemon");
  verb->add_option("--cell", options->cell, "the cell file, with --camera");
  verb->add_option("--camera", options->camera, "its name in the cell");
  verb->add_option("--address", options->address, "of a GigE Vision camera, with --size");
  verb->add_option("--device", options->device, "of a video device, with --size");
  verb->add_option("--folder", options->folder, "of pictures, with --size");
  verb->add_option("--size", options->size, "WIDTHxHEIGHT of the picture, px")->delimiter('x')->expected(2);
  verb->add_option("--out", options->out, "the PNG file to write")->required();
  verb->add_flag("--json", options->json,
                 "one JSON object on stdout: status, reason, file, width_px, height_px, white, health");
  verb->footer(snapshot_help);
  verb->callback(
      [options, &exit_status] { exit_status = run([&] { return snapshot(*options); }, options->json); });
}

}  // namespace

void add_cameras(CLI::App& app, int& exit_status) {
  CLI::App* cameras = app.add_subcommand("cameras", "Cameras without a daemon: list, snapshot");
  cameras->require_subcommand(1);
  add_list(*cameras, exit_status);
  add_snapshot(*cameras, exit_status);
}

}  // namespace zeropose
