#include "sim/sim_file.h"

#include "config/cameras.h"
#include "config/files.h"
#include "config/json_reader.h"

namespace zeropose {
namespace {

PictureSettings read_picture(JsonObject& object) {
  PictureSettings picture;
  int seed = 1;
  object.read("surface_grey", picture.surface_grey, {1, 250});
  object.read("mark_grey", picture.mark_grey, {1, 250});
  object.read("illumination_gradient", picture.illumination_gradient, {0, 1});
  object.read("blur_sigma_px", picture.blur_sigma_px, {0.3, 5});
  object.read("noise_sigma_grey", picture.noise_sigma_grey,
              {0, 50, true});  // two like pictures are a frozen camera
  object.read("clutter", picture.clutter, 0, 100);
  object.read("seed", seed, 0, std::numeric_limits<int>::max());
  picture.seed = static_cast<std::uint64_t>(seed);
  return picture;
}

}  // namespace

SimFile load_sim_file(const std::filesystem::path& path) {
  const JsonValue tree = parse_json(read_file(path), path.string());
  JsonReading reading(path.string());
  SimFile file;
  read_object(tree, "", reading, [&](JsonObject& top) {
    top.read("cameras", [&](JsonObject& cameras) { file.cameras = read_cameras(cameras); });
    top.read("picture", [&](JsonObject& picture) { file.picture = read_picture(picture); });
  });
  reading.throw_if_wrong();
  return file;
}

std::string calibration_text(std::span<const CalibratedCamera> cameras, std::string_view comment) {
  return "// " + std::string(comment) + "\n" + cameras_text({cameras.begin(), cameras.end()});
}

}  // namespace zeropose
