#include "daemon/cli/camera_choice.h"

#include <algorithm>
#include <fstream>

#include "config/cell.h"
#include "config/text.h"
#include "drivers/picture_file.h"

namespace zeropose::cli {
namespace {

CameraOptions of_cell(const CameraChoice& options) {
  const Cell cell = load_cell(options.cell);
  const auto camera = std::ranges::find(cell.cameras, options.camera, &CameraOptions::name);
  if (camera == cell.cameras.end())
    throw std::invalid_argument(
        concat({options.cell, ": has no camera \"", options.camera, "\"; name one by --camera"}));
  return *camera;
}

}  // namespace

void add_choice(cli::Verb verb, CameraChoice& choice) {
  verb.add_option("--cell", choice.cell, "the cell file, with --camera");
  verb.add_option("--camera", choice.camera, "its name in the cell");
  verb.add_option("--address", choice.address, "of a GigE Vision camera, with --size");
  verb.add_option("--device", choice.device, "of a video device, with --size");
  verb.add_option("--folder", choice.folder, "of pictures, with --size");
  verb.add_option("--size", choice.size, "WIDTHxHEIGHT of the picture, px").delimiter('x').expected(2);
}

CameraOptions chosen_camera(const CameraChoice& options) {
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

void write_png(const std::string& path, const Frame& frame) {
  const std::vector<std::uint8_t> png = encode_png(frame);
  std::ofstream file(path, std::ios::binary);
  file.write(reinterpret_cast<const char*>(png.data()), static_cast<std::streamsize>(png.size()));
  file.close();
  if (!file) throw std::runtime_error(concat({path, ": cannot be written"}));
}

}  // namespace zeropose::cli
