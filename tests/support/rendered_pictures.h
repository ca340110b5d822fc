// Rendered pictures of a scene that a test may spoil before they are exposed.
#pragma once

#include <functional>
#include <vector>

#include "measure/measurement.h"
#include "sim/renderer.h"

namespace zeropose::test {

// Grey levels of one picture without noise, row by row.
using CleanPicture = std::vector<float>;

class SceneRenderer {
 public:
  explicit SceneRenderer(const Scene& scene) : cameras_(scene.cameras) {
    for (std::size_t camera = 0; camera < scene.cameras.size(); ++camera)
      renderers_.emplace_back(scene, camera);
  }

  std::vector<CleanPicture> clean(const Pose& X_WO, const Faults& faults = {}) const {
    std::vector<CleanPicture> pictures;
    for (const CameraRenderer& renderer : renderers_)
      pictures.push_back(renderer.clean_picture(X_WO, faults));
    return pictures;
  }
  const std::vector<CalibratedCamera>& cameras() const { return cameras_; }

 private:
  std::vector<CalibratedCamera> cameras_;
  std::vector<CameraRenderer> renderers_;
};

// One exposure of each picture, with noise drawn anew.
class Exposed {
 public:
  Exposed(const std::vector<CalibratedCamera>& cameras, const std::vector<CleanPicture>& clean,
          double noise_sigma_grey, std::uint64_t& noise_state) {
    pixels_.reserve(clean.size());
    for (std::size_t camera = 0; camera < clean.size(); ++camera) {
      const CameraModel& model = cameras[camera].model;
      auto& pixels = pixels_.emplace_back(clean[camera].size());
      add_noise(clean[camera], noise_sigma_grey, noise_state, pixels);
      images_.push_back({camera, {pixels.data(), model.width_px, model.height_px, model.width_px}});
    }
  }
  std::vector<CameraImage>& images() { return images_; }

 private:
  std::vector<std::vector<std::uint8_t>> pixels_;
  std::vector<CameraImage> images_;
};

}  // namespace zeropose::test
