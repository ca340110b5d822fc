// The example cell with a change, and what the loader says to it.
#pragma once

#include <nlohmann/json.hpp>

#include "config/cell.h"
#include "config/files.h"

namespace zeropose {

using Json = nlohmann::ordered_json;

inline const std::string& example_text() {
  static const std::string text = read_file(ZEROPOSE_SOURCE_DIR "/config/cells/car-body.json");
  return text;
}

inline const std::string& example_calibration_text() {
  static const std::string text = read_file(ZEROPOSE_SOURCE_DIR "/config/cells/car-body.calibration.json");
  return text;
}

inline Json parsed(const std::string& text) { return Json::parse(text, nullptr, true, true); }
// With its first robot alone.
inline Json example() {
  Json json = parsed(example_text());
  json["robots"].erase(1);
  return json;
}
inline Json example_calibration() { return parsed(example_calibration_text()); }

inline std::vector<std::string> mistakes_in(const std::string& cell,
                                            const std::string& calibration = example_calibration_text()) {
  try {
    parse_cell({cell, "cell.json", calibration, "calibration.json"});
  } catch (const ConfigError& error) {
    return error.mistakes();
  }
  return {};
}

inline std::vector<std::string> mistakes_in(const Json& cell) { return mistakes_in(cell.dump()); }

// Another example cell and its calibration, to be changed.
struct ExampleFiles {
  explicit ExampleFiles(const std::string& name)
      : json(parsed(text_of(name + ".json"))), calibration(parsed(text_of(name + ".calibration.json"))) {}

  Json& job() { return json["jobs"][0]; }
  std::vector<std::string> mistakes() const { return mistakes_in(json.dump(), calibration.dump()); }
  static std::string text_of(const std::string& file) {
    return read_file(std::string(ZEROPOSE_SOURCE_DIR) + "/config/cells/" + file);
  }

  Json json, calibration;
};

}  // namespace zeropose
