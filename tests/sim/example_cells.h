// The example cells for the simulator's tests.
#pragma once

#include <string>

#include "config/cell.h"
#include "sim/scene.h"

namespace zeropose::test {

inline const std::string cells = std::string(ZEROPOSE_SOURCE_DIR) + "/config/cells/";

inline Scene example(const std::string& cell) {
  return load_scene(load_cell(cells + cell + ".json"), cells + cell + ".sim.json");
}

inline Scene car_body() { return example("car-body"); }

// Without what hides the law under test: no clutter, light the same everywhere.
inline Scene flat(Scene scene) {
  scene.picture.clutter = 0;
  scene.picture.illumination_gradient = 0;
  return scene;
}

inline Scene flat_car_body() { return flat(car_body()); }

}  // namespace zeropose::test
