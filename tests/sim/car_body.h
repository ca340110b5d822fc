// The car-body cell for the simulator's tests.
#pragma once

#include <string>

#include "config/cell.h"
#include "sim/scene.h"

namespace zeropose::test {

inline const std::string cells = std::string(ZEROPOSE_SOURCE_DIR) + "/config/cells/";

inline Scene car_body() {
  return load_scene(load_cell(cells + "car-body.json"), cells + "car-body.sim.json");
}

// Without what hides the law under test: no clutter, light the same everywhere.
inline Scene flat_car_body() {
  Scene scene = car_body();
  scene.picture.clutter = 0;
  scene.picture.illumination_gradient = 0;
  return scene;
}

}  // namespace zeropose::test
