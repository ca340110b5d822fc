// Cameras from and to nlohmann's JSON, for programs that already hold such a value. Kept apart from
// cameras.h: this include is heavy.
#pragma once

#include <nlohmann/json.hpp>

#include "config/cameras.h"

namespace zeropose {

// `where` names the value in messages, e.g. "car-body.sim.json: cameras". Names come in the order of the
// value, which nlohmann::json sorts. Throws ConfigError.
inline std::vector<CalibratedCamera> cameras_from_json(const nlohmann::json& value,
                                                       const std::string& where) {
  return parse_cameras(value.dump(), where);
}

}  // namespace zeropose
