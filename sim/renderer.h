// What a camera of the simulated cell sees (spec 50 M0, 70).
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "sim/carried.h"
#include "sim/look.h"
#include "sim/mark_plates.h"
#include "sim/painter.h"
#include "sim/scene.h"

namespace zeropose {

class CameraRenderer {
 public:
  // `camera` is an index into scene.cameras. Decides once, by the scene's seed, what stands and hangs around.
  CameraRenderer(const Scene& scene, std::size_t camera);

  // Grey levels, row by row, with blur and without noise, not clamped. The same pose and faults give the same
  // picture bit by bit. May be called from several threads.
  std::vector<float> clean_picture(const Pose& X_WO, const Faults& faults = {},
                                   const std::optional<Carried>& carried = std::nullopt) const;

 private:
  PixelRays rays_;
  std::string name_;
  Pose X_CW_;
  std::unique_ptr<const Look> look_;
  std::vector<MarkPlate> references_;
  double blur_sigma_px_;
};

// Adds normally distributed noise, rounds and clamps to 8 bit: pixels[i] = clean[i] + noise. Every call draws
// anew and moves the state on; start it with any number, another one for each camera. Sizes must be equal.
void add_noise(std::span<const float> clean, double sigma_grey, std::uint64_t& generator_state,
               std::span<std::uint8_t> pixels);

}  // namespace zeropose
