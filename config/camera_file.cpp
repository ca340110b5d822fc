#include "config/camera_file.h"

#include <algorithm>
#include <nlohmann/json.hpp>

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

CameraFile read_one(JsonObject& camera) {
  CameraFile read;
  read.camera.model = read_model(camera);
  read.camera.on_hand = camera.has("X_HC");
  read.has_pose = camera.read_optional(read.camera.on_hand ? "X_HC" : "X_WC", read.camera.X_WC);
  return read;
}

std::vector<CameraFile> read_all(const JsonValue& tree, const std::string& file) {
  std::vector<CameraFile> all;
  JsonReading reading(file);
  read_object(tree, "", reading, [&](JsonObject& object) {
    if (is_one_camera(tree)) {
      all.push_back(read_one(object));
      return;
    }
    object.read_members([&](const std::string& name, JsonObject& camera) {
      all.push_back(read_one(camera));
      all.back().camera.name = name;
    });
  });
  reading.throw_if_wrong();
  if (all.empty()) throw ConfigError({concat({file, ": found no camera, expected one"})});
  return all;
}

}  // namespace

CameraFile parse_camera(std::string_view text, const std::string& file, std::string_view name) {
  const std::vector<CameraFile> all = read_all(parse_json(text, file), file);
  if (all.size() == 1 && (name.empty() || all[0].camera.name.empty())) return all[0];
  std::string names;
  for (const CameraFile& one : all) {
    if (one.camera.name == name) return one;
    names += concat({names.empty() ? "" : ", ", one.camera.name});
  }
  if (name.empty())
    throw ConfigError({concat({file, ": found several cameras (", names, "), expected the name of one"})});
  throw ConfigError({concat({file, ": found no camera ", in_quotes(name), ", expected one of ", names})});
}

CameraFile load_camera(const std::filesystem::path& path, std::string_view name) {
  return parse_camera(read_file(path), path.string(), name);
}

std::string camera_file_text(const CameraFile& file) {
  const std::string text = camera_text(file.camera, file.has_pose);
  if (file.camera.name.empty()) return text + "\n";
  return concat({"{\n  ", nlohmann::json(file.camera.name).dump(), ": ", text, "\n}\n"});
}

}  // namespace zeropose
