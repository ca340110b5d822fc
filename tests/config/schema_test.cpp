// config/cell.schema.json says the same as the loader.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <functional>

#include "example_cell.h"
#include "protocol/conventions.h"

namespace zeropose {
namespace {

using testing::IsEmpty;

Json schema() { return parsed(read_file(ZEROPOSE_SOURCE_DIR "/config/cell.schema.json")); }

// Visits every property: its path with indices as [], its pointer into the example, its schema, and whether
// it is required.
using Visit =
    std::function<void(const std::string& path, const std::string& pointer, const Json& property, bool)>;

// A job has other keys besides where it looks at marks, as the first one of the example does.
Json required_in(const Json& object) {
  Json required = object["required"];
  if (object.contains("then"))
    required.insert(required.end(), object["then"]["required"].begin(), object["then"]["required"].end());
  return required;
}

void walk(const Json& object, const std::string& path, const std::string& pointer, const Visit& visit) {
  const Json required = required_in(object);
  for (const auto& [key, property] : object["properties"].items()) {
    const std::string key_path = path + (path.empty() ? "" : ".") + key;
    const std::string key_pointer = pointer + "/" + key;
    visit(key_path, key_pointer, property,
          std::find(required.begin(), required.end(), key) != required.end());
    if (property.contains("properties")) walk(property, key_path, key_pointer, visit);
    if (property.contains("items") && property["items"].contains("properties"))
      walk(property["items"], key_path + "[]", key_pointer + "/0", visit);
  }
}

// Jobs of the other kinds, with every key.
Json gap_job() {
  Json job = parsed(R"({"name": "gaps", "number": 7, "gaps": {"pane_in_hand": [-1200, 2000, 200, 0, 0, 0],
    "even": true, "min_gaps": 4, "shape_sigma_mm": 0.1, "tolerance_mm": 0.05, "max_sigma_mm": 0.05,
    "max_motion": {"x_mm": 5, "y_mm": 5, "rz_deg": 1}, "places": []}})");
  for (const char* name : {"a", "b", "c", "d"}) {
    Json place = parsed(R"({"camera": "hand", "window": {"centre_px": [300, 200], "direction_deg": 0,
      "half_across_px": 80, "half_along_px": 50}, "frame": "bright_to_dark", "pane": "dark_to_bright",
      "gap_mm": [1, 9], "direction_tolerance_deg": 10, "max_wedge_deg": 2, "min_length_share": 0.4,
      "min_contrast": 20, "max_blur_px": 3, "plane": {"point_mm": [0, 0, 0], "normal": [0, 0, 1]},
      "weight": 1, "wanted_mm": 0})");
    place["name"] = name;
    job["gaps"]["places"].push_back(place);
  }
  return job;
}

Json wheel_cell(const char* ending) {
  return parsed(read_file(std::string(ZEROPOSE_SOURCE_DIR) + "/config/cells/wheel-alignment" + ending));
}

// Its cameras come with it.
void add_wheel_job(Json& json) {
  const Json cell = wheel_cell(".json");
  for (Json camera : cell["cameras"]) {
    camera["name"] = "wheel " + camera["name"].get<std::string>();
    json["cameras"].push_back(camera);
  }
  Json job = cell["jobs"][0];
  job["number"] = 8;
  for (Json& sensor : job["wheel"]["sensors"])
    for (const char* side : {"left", "right"}) sensor[side] = "wheel " + sensor[side].get<std::string>();
  job["wheel"]["lines"].update(
      parsed(R"({"sigma_px": 1.7, "min_contrast": 10, "min_length_px": 10, "max_join_px": 45})"));
  job["wheel"].update(parsed(R"({"unevenness_mm": 0.15, "out_of_round_mm": 0.3, "max_sigma_deg": 0.02})"));
  json["jobs"].push_back(job);
}

// The example with every optional key present.
Json full_example() {
  Json json = example();
  json["$schema"] = "../cell.schema.json";
  json["cameras"][0].update(parsed(R"({"x_px": 0, "y_px": 0, "pixel_format": "mono8", "trigger": "line",
    "frame_rate_hz": 25, "exposure_us": 2000, "gain": 1.5, "black_level": 4, "gamma": 1, "serial": "4711",
    "user_name": "left", "trigger_line": "Line2", "network": {"interface": "eth1", "packet_bytes": 1500,
    "packet_socket": "never", "resend": false, "ptp": true}})"));
  json["cameras"][1] = parsed(R"({"name": "camera2", "driver": "v4l2", "width_px": 768, "height_px": 572,
    "device": "/dev/video0", "input": 1, "fields": "both", "controls": [{"name": "gain", "value": 3}]})");
  json["cameras"][2] = parsed(R"({"name": "camera3", "driver": "folder", "width_px": 768, "height_px": 572,
    "path": "pictures", "loop": true})");
  json["cameras"].push_back(parsed(R"({"name": "hand", "driver": "folder", "width_px": 768, "height_px": 572,
    "path": "pictures", "on_hand_of": "robot2"})"));
  json["jobs"][0]["positions"] = Json::array({parsed(R"({"name": "above", "cameras": ["hand"],
    "hand_pose": [0, 0, 0, 0, 0, 0], "tolerance_mm": 1, "tolerance_deg": 0.5})")});
  json["jobs"][0]["positions_within_s"] = 30;
  json["jobs"][0]["marks"][0]["cameras"].push_back("above");
  json["jobs"][0]["marks"][0]["tolerance_mm"] = 2;
  json["jobs"][0]["marks"][0]["sigma_mm"] = 0.1;
  json["jobs"][0]["marks"][0]["kind"] = "dark_ring";
  json["jobs"][0]["marks"][0]["inner_radius_mm"] = 1;
  json["jobs"][0]["marks"][1]["kind"] = "bright_corner";
  json["jobs"][0]["marks"][1]["edges"] = {{1, 0, 0}, {0, 1, 0}};
  json["jobs"][0]["planar"] = {0, 0, 0, 0, 0, 0};
  json["jobs"][0]["requirements"]["max_hidden_mm"] = 1.5;
  json["jobs"][0]["requirements"]["max_displacement_mm"] = 45;
  json["jobs"][0]["requirements"]["max_step_mm"] = 30;
  json["jobs"][0]["requirements"]["max_step_deg"] = 0.25;
  json["jobs"].push_back(gap_job());
  add_wheel_job(json);
  json["robots"][0]["axis"] = {{"direction", {1, 0, 0}}, {"zero_mm", 0}};
  json["reference_points"] =
      Json::array({parsed(R"({"name": "r", "cameras": ["camera1"], "kind": "bright_ring", "radius_mm": 5,
    "inner_radius_mm": 2, "position_mm": [-525, -751, 200], "normal": [0, -0.6, -0.8], "pixel": [100, 90],
    "diameter_px": 30, "group": "plate"})")});
  json["reference_check"] =
      parsed(R"({"search_mm": 20, "sigma_px": 0.05, "tolerance_px": 0.1, "suspicious_blocks": true})");
  json["robots"][0]["require_command_crc"] = false;
  json["robots"][0]["allowed_writers"] = {"10.0.0.1"};
  json["robots"][0]["allowed_readers"] = {"10.0.0.2"};
  json["robots"][0]["result_data_id"] = 1;
  json["robots"][0]["command_data_id"] = 2;
  for (const char* link :
       {R"({"type": "modbus-rtu", "device": "/dev/ttyS0", "baud": 9600, "parity": "none",
    "stop_bits": 2, "unit": 1, "gap_tolerance_ms": 20})",
        R"({"type": "modbus-client", "address": "10.0.0.5", "port": 502, "command_address": 1,
    "result_address": 100, "life_address": 200, "poll_ms": 5, "response_timeout_ms": 50, "max_registers": 32})",
        R"({"type": "can", "interface": "can0", "node": 5, "fd": false, "heartbeat_ms": 100,
    "length_scale_um": 10, "angle_scale_deg": 0.001, "rotation_vector_scale_rad": 0.0001, "start_at_once": true})"}) {
    Json robot = example()["robots"][0];
    robot["name"] = "robot" + std::to_string(json["robots"].size() + 1);
    robot["link"] = parsed(link);
    robot["frame"] = "object_zero";  // the motion of a pane is told in its own frame
    json["robots"].push_back(robot);
  }
  return json;
}

// With the calibration of its camera on a hand, and of those that look at a wheel.
std::vector<std::string> mistakes_of(const Json& full) {
  Json calibration = example_calibration();
  calibration["hand"] = calibration["camera1"];
  calibration["hand"]["X_HC"] = calibration["hand"]["X_WC"];
  calibration["hand"].erase("X_WC");
  const Json wheel = wheel_cell(".calibration.json");
  for (const auto& [name, camera] : wheel.items()) calibration["wheel " + name] = camera;
  return mistakes_in(full.dump(), calibration.dump());
}

// The place of a key in the example: each driver has keys of its own and a camera of its own there, each type
// of link a robot.
Json::json_pointer place_of_key(const Json& full, const std::string& pointer) {
  for (const std::string list : {"/cameras/", "/robots/", "/jobs/", "/jobs/0/marks/"})
    for (std::size_t i = 0; i < 5; ++i) {
      std::string moved = pointer;
      if (moved.starts_with(list + "0/")) moved.replace(0, list.size() + 1, list + std::to_string(i));
      if (full.contains(Json::json_pointer(moved))) return Json::json_pointer(moved);
    }
  return Json::json_pointer(pointer);
}

TEST(Schema, KnowsExactlyTheLoadersKeys) {
  std::set<std::string> keys;
  walk(schema(), "", "", [&](const std::string& path, auto&&...) { keys.insert(path); });
  EXPECT_EQ(keys, known_cell_keys());
  EXPECT_GT(keys.size(), 50U);
}

TEST(Schema, DescribesEveryKeyAndAllowsNoOther) {
  const auto strict = [](const std::string& path, const std::string&, const Json& property, bool) {
    EXPECT_TRUE(property.contains("description")) << path;
    for (const Json* object : {&property, property.contains("items") ? &property["items"] : &property})
      if (object->contains("properties")) {
        EXPECT_EQ((*object)["additionalProperties"], false) << path;
      }
  };
  EXPECT_EQ(schema()["additionalProperties"], false);
  walk(schema(), "", "", strict);
}

TEST(Schema, RequiresWhatTheLoaderRequires) {
  const Json full = full_example();
  ASSERT_THAT(mistakes_of(full), IsEmpty());
  walk(schema(), "", "",
       [&](const std::string& path, const std::string& pointer, const Json&, bool required) {
         if (path == "jobs[].gaps" || path == "jobs[].wheel") return;  // without it is a job with marks
         const Json::json_pointer place = place_of_key(full, pointer);
         ASSERT_TRUE(full.contains(place)) << path;
         Json without = full;
         without[place.parent_pointer()].erase(place.back());
         const std::vector<std::string> mistakes = mistakes_of(without);
         const bool refused = std::any_of(mistakes.begin(), mistakes.end(), [](const std::string& mistake) {
           return mistake.find("found no such key") != std::string::npos;
         });
         EXPECT_EQ(refused, required) << path;
       });
}

// True when the loader finds fault with the value itself (not with how it fits to others).
bool refuses(const std::string& pointer, const Json& value) {
  Json json = full_example();
  json[place_of_key(json, pointer)] = value;
  for (const std::string& mistake : mistakes_of(json))
    if (mistake.find("expected a number") != std::string::npos ||
        mistake.find("expected an integer") != std::string::npos)
      return true;
  return false;
}

TEST(Schema, HasTheLoadersBounds) {
  int bounds = 0;
  walk(schema(), "", "",
       [&](const std::string& path, const std::string& pointer, const Json& property, bool) {
         const auto bound = [&](const char* name, double step, bool itself_allowed) {
           if (!property.contains(name)) return;
           ++bounds;
           const Json limit = property[name];
           EXPECT_EQ(refuses(pointer, limit), !itself_allowed) << path << " " << name;
           const Json beyond = limit.is_number_integer()
                                   ? Json(limit.get<std::int64_t>() + static_cast<std::int64_t>(step))
                                   : Json(limit.get<double>() + step);
           EXPECT_TRUE(refuses(pointer, beyond)) << path << " " << beyond;
         };
         bound("minimum", -1, true);
         bound("maximum", 1, true);
         bound("exclusiveMinimum", -1, false);
       });
  EXPECT_GT(bounds, 40);
}

TEST(Schema, ListsTheConventionsOfTheWire) {
  std::vector<std::string> names;
  for (const Convention convention : all_conventions())
    if (convention != Convention::matrix) names.emplace_back(name_of(convention));
  EXPECT_EQ(schema()["properties"]["robots"]["items"]["properties"]["convention"]["enum"], Json(names));
}

}  // namespace
}  // namespace zeropose
