// Simulated cameras whose pictures carry their number in the pixels, so that a picture tells which scene it
// shows and when it was drawn.
#pragma once

#include <atomic>
#include <chrono>
#include <cstring>
#include <semaphore>
#include <string>
#include <vector>

#include "drivers/camera.h"
#include "sim/gige_server.h"

namespace zeropose {

// What the first bytes of a numbered picture say; the rest follows from the scene and the place.
struct PictureNumber {
  std::uint64_t scene = 0;  // counted up by every new_scene()
  std::uint64_t drawn = 0;  // counted up by every picture
  std::uint64_t camera = 0;
};

inline PictureNumber number_of(const Frame& frame) {
  PictureNumber number;
  std::memcpy(&number, frame.pixels.get(), sizeof number);
  return number;
}

// Differs between neighbouring scenes and between neighbouring packets.
inline std::uint8_t pixel_of(std::uint64_t scene, std::size_t place) {
  return static_cast<std::uint8_t>(37 * scene + place / 64);
}

// Every pixel behind the number must be that of the scene and in its place.
inline bool all_of_one_scene(const Frame& frame) {
  const std::uint64_t scene = number_of(frame).scene;
  const auto width = static_cast<std::size_t>(frame.width_px);
  for (std::size_t i = sizeof(PictureNumber); i < width * static_cast<std::size_t>(frame.height_px); ++i)
    if (frame.row(static_cast<int>(i / width))[i % width] != pixel_of(scene, i)) return false;
  return true;
}

class NumberedCameras {
 public:
  explicit NumberedCameras(std::size_t count, int width_px = 768, int height_px = 572,
                           const std::string& genicam = {})
      : options_(options_for(count, width_px, height_px)),
        server_(served(options_, genicam),
                [this](std::size_t camera, std::span<std::uint8_t> pixels) { draw(camera, pixels); }) {}

  const CameraOptions& options(std::size_t camera) const { return options_[camera]; }
  GigeServer& server() { return server_; }

  // Frames exposed from now on show the scene whose number is returned.
  std::uint64_t new_scene() {
    const std::uint64_t scene = ++scene_;
    server_.picture_changed();
    return scene;
  }

  static std::vector<CameraOptions> options_for(std::size_t count, int width_px = 768, int height_px = 572) {
    std::vector<CameraOptions> all;
    for (std::size_t i = 0; i < count; ++i) {
      CameraOptions options;
      options.name = "camera" + std::to_string(i + 1);
      options.gige.address = "127.0.0." + std::to_string(11 + i);
      options.width_px = width_px;
      options.height_px = height_px;
      all.push_back(std::move(options));
    }
    return all;
  }

 private:
  static std::vector<ServedCamera> served(const std::vector<CameraOptions>& all, const std::string& genicam) {
    std::vector<ServedCamera> cameras;
    for (const CameraOptions& options : all)
      cameras.push_back({.name = options.name,
                         .address = options.gige.address,
                         .width_px = options.width_px,
                         .height_px = options.height_px,
                         .user_name = "user-" + options.name,
                         .genicam = genicam});
    return cameras;
  }

  void draw(std::size_t camera, std::span<std::uint8_t> pixels) {
    const PictureNumber number{scene_, ++drawn_, camera};
    for (std::size_t i = 0; i < pixels.size(); ++i) pixels[i] = pixel_of(number.scene, i);
    std::memcpy(pixels.data(), &number, sizeof number);
  }

  std::atomic<std::uint64_t> scene_ = 1, drawn_ = 0;
  std::vector<CameraOptions> options_;
  GigeServer server_;
};

}  // namespace zeropose
