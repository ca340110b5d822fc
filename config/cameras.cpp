#include "config/cameras.h"

#include <array>
#include <nlohmann/json.hpp>

#include "config/atomic_file.h"
#include "config/files.h"
#include "config/json_reader.h"

namespace zeropose {
namespace {

constexpr int largest_side_px = 65535;
constexpr double largest_focal_length_px = 1e7;
constexpr double largest_origin_px = 1e6;
constexpr double largest_coefficient = 1e4;
constexpr std::array<std::string_view, 2> model_names{"division", "brown"};

Distortion read_distortion(JsonObject& camera) {
  const NumberRange range{-largest_coefficient, largest_coefficient};
  std::size_t model = 0;
  if (!camera.read_word("model", model_names, model)) {
    // The kind is unknown: accept the coefficients of both rather than call them unknown.
    double ignored = 0;
    for (const char* key : {"K", "k1", "k2", "p1", "p2", "k3"}) camera.read_optional(key, ignored, range);
    return Division{};
  }
  if (model == 0) {
    Division division;
    camera.read("K", division.K, range);
    return division;
  }
  BrownConrady brown;
  camera.read("k1", brown.k1, range);
  camera.read("k2", brown.k2, range);
  camera.read("p1", brown.p1, range);
  camera.read("p2", brown.p2, range);
  camera.read("k3", brown.k3, range);
  return brown;
}

// Of a camera on a robot's hand it is the pose there.
const char* pose_key(bool on_hand) { return on_hand ? "X_HC" : "X_WC"; }

nlohmann::ordered_json six_json(const Pose& X_AB) {
  const SixNumbers six = to_six_numbers(X_AB);
  return {six.x_mm, six.y_mm, six.z_mm, six.rx_deg, six.ry_deg, six.rz_deg};
}

nlohmann::ordered_json camera_json(const CalibratedCamera& camera) {
  const CameraModel& model = camera.model;
  nlohmann::ordered_json json;
  const auto* division = std::get_if<Division>(&model.distortion);
  json["model"] = model_names[division != nullptr ? 0 : 1];
  json["width"] = model.width_px;
  json["height"] = model.height_px;
  json["fx"] = model.fx_px;
  json["fy"] = model.fy_px;
  json["cx"] = model.cx_px;
  json["cy"] = model.cy_px;
  if (division != nullptr) {
    json["K"] = division->K;
  } else {
    const auto& brown = std::get<BrownConrady>(model.distortion);
    json["k1"] = brown.k1;
    json["k2"] = brown.k2;
    json["p1"] = brown.p1;
    json["p2"] = brown.p2;
    json["k3"] = brown.k3;
  }
  json[pose_key(camera.on_hand)] = six_json(camera.X_WC);
  return json;
}

}  // namespace

CameraModel read_model(JsonObject& camera) {
  CameraModel model;
  model.distortion = read_distortion(camera);
  camera.read("width", model.width_px, 1, largest_side_px);
  camera.read("height", model.height_px, 1, largest_side_px);
  camera.read("fx", model.fx_px, {0, largest_focal_length_px, true});
  camera.read("fy", model.fy_px, {0, largest_focal_length_px, true});
  camera.read("cx", model.cx_px, {-largest_origin_px, largest_origin_px});
  camera.read("cy", model.cy_px, {-largest_origin_px, largest_origin_px});
  return model;
}

CalibratedCamera read_camera(JsonObject& camera) {
  CalibratedCamera read;
  read.model = read_model(camera);
  read.on_hand = camera.has(pose_key(true));
  camera.read(pose_key(read.on_hand), read.X_WC);
  return read;
}

std::vector<CalibratedCamera> read_cameras(JsonObject& cameras) {
  std::vector<CalibratedCamera> all;
  cameras.read_members([&](const std::string& name, JsonObject& camera) {
    CalibratedCamera read = read_camera(camera);
    read.name = name;
    all.push_back(std::move(read));
  });
  return all;
}

std::vector<CalibratedCamera> parse_cameras(std::string_view text, const std::string& file) {
  const JsonValue tree = parse_json(text, file);
  JsonReading reading(file);
  std::vector<CalibratedCamera> cameras;
  read_object(tree, "", reading, [&](JsonObject& map) { cameras = read_cameras(map); });
  if (cameras.empty() && reading.mistakes().empty())
    reading.add_mistake("", "no camera", "at least one camera by name");
  reading.throw_if_wrong();
  return cameras;
}

std::vector<CalibratedCamera> load_cameras(const std::filesystem::path& path) {
  return parse_cameras(read_file(path), path.string());
}

std::string cameras_text(const std::vector<CalibratedCamera>& cameras) {
  std::string text = "{";
  for (const CalibratedCamera& camera : cameras)
    text += (text.size() > 1 ? ",\n  " : "\n  ") + nlohmann::json(camera.name).dump() + ": " +
            camera_json(camera).dump();
  return text + "\n}\n";
}

std::string camera_text(const CalibratedCamera& camera, bool with_pose) {
  nlohmann::ordered_json json = camera_json(camera);
  if (!with_pose) json.erase(pose_key(camera.on_hand));
  return json.dump();
}

void save_cameras(const std::filesystem::path& path, const std::vector<CalibratedCamera>& cameras) {
  replace_file(path, cameras_text(cameras));
}

}  // namespace zeropose
