#include "config/camera_file.h"

#include <algorithm>

#include "config/files.h"
#include "config/json_reader.h"
#include "config/text.h"

namespace zeropose {
namespace {

// Cameras by name hold objects only.
bool is_one_camera(const JsonValue& tree) {
  const auto* object = std::get_if<JsonValue::Object>(&tree.value);
  if (object == nullptr) return false;
  return std::any_of(object->begin(), object->end(), [](const auto& member) {
    return !std::holds_alternative<JsonValue::Object>(member.second.value);
  });
}

CameraFile read_one(const JsonValue& tree, const std::string& file) {
  CameraFile read;
  JsonReading reading(file);
  read_object(tree, "", reading, [&](JsonObject& camera) {
    read.camera.model = read_model(camera);
    read.has_pose = camera.read_optional("X_WC", read.camera.X_WC);
  });
  reading.throw_if_wrong();
  return read;
}

}  // namespace

CameraFile parse_camera(std::string_view text, const std::string& file, std::string_view name) {
  const JsonValue tree = parse_json(text, file);
  if (is_one_camera(tree)) return read_one(tree, file);
  const std::vector<CalibratedCamera> cameras = parse_cameras(text, file);
  std::string names;
  for (const CalibratedCamera& camera : cameras) {
    if (camera.name == name || (name.empty() && cameras.size() == 1)) return {camera, true};
    names += concat({names.empty() ? "" : ", ", camera.name});
  }
  if (name.empty())
    throw ConfigError({concat({file, ": found several cameras (", names, "), expected the name of one"})});
  throw ConfigError({concat({file, ": found no camera ", in_quotes(name), ", expected one of ", names})});
}

CameraFile load_camera(const std::filesystem::path& path, std::string_view name) {
  return parse_camera(read_file(path), path.string(), name);
}

std::string camera_file_text(const CalibratedCamera& camera) {
  return camera.name.empty() ? camera_text(camera) + "\n" : cameras_text({camera});
}

}  // namespace zeropose
