// The kernel's test driver vivid as cameras: devices 0..3 have a digital input with our own pictures looped
// in, device 0 also an analog one, device 4 describes its pixels by planes. The numbers are those of
// v4l2.job.
#pragma once

#include <fcntl.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <array>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <random>
#include <string>
#include <vector>

#include "drivers/camera_worker.h"
#include "drivers/v4l2_camera.h"
#include "sim/v4l2_output.h"

namespace zeropose {

using std::chrono::steady_clock;
using namespace std::chrono_literals;

// Emulation is slow: nothing here measures time.
constexpr auto patience = 10s;

inline std::string capture_device(int device) { return "/dev/video" + std::to_string(10 + 2 * device); }
inline std::string output_device(int device) { return "/dev/video" + std::to_string(11 + 2 * device); }

// What a shell command prints: v4l2-ctl, the independent peer.
inline std::string output_of(const std::string& command) {
  std::string text;
  FILE* pipe = ::popen((command + " 2>&1").c_str(), "r");
  if (pipe == nullptr) return text;
  std::array<char, 512> part{};
  while (std::fgets(part.data(), part.size(), pipe) != nullptr) text += part.data();
  ::pclose(pipe);
  return text;
}

inline void set_control(int device, const std::string& control, int value) {
  const std::string said = output_of("v4l2-ctl -d " + capture_device(device) + " --set-ctrl " + control +
                                     "=" + std::to_string(value));
  EXPECT_EQ(said, "");
}

inline CameraOptions options_of(int device, int width_px = 768, int height_px = 572) {
  CameraOptions options;
  options.name = "camera" + std::to_string(device + 1);
  options.driver = CameraDriver::v4l2;
  options.width_px = width_px;
  options.height_px = height_px;
  options.v4l2.device = capture_device(device);
  options.v4l2.input = 0;
  options.v4l2.controls = {{"Loop Video", 1}, {"osd_text_mode", 2}};
  return options;
}

inline ShownPicture shown_by(int device, int width_px = 768, int height_px = 572) {
  return {output_device(device), capture_device(device), width_px, height_px};
}

inline std::vector<std::uint8_t> random_picture(unsigned seed, std::size_t bytes) {
  std::mt19937 random(seed);
  std::vector<std::uint8_t> picture(bytes);
  for (std::uint8_t& pixel : picture) pixel = static_cast<std::uint8_t>(random());
  return picture;
}

inline bool shows(const Frame& frame, std::span<const std::uint8_t> picture) {
  for (int v = 0; v < frame.height_px; ++v)
    if (!std::ranges::equal(frame.row(v), picture.subspan(static_cast<std::size_t>(v) * frame.row_bytes(),
                                                          frame.row_bytes())))
      return false;
  return true;
}

inline Frame grab(Camera& camera) {
  camera.trigger();
  std::optional<Frame> frame = camera.grab(steady_clock::now() + patience);
  if (!frame) throw std::runtime_error("no frame");
  return std::move(*frame);
}

class Vivid : public testing::Test {
 protected:
  void SetUp() override {
    if (!std::filesystem::exists("/sys/bus/platform/drivers/vivid"))
      GTEST_SKIP() << "the kernel's module vivid is not loaded; tests/guest/run.sh has a kernel with it";
  }
};

// The error of opening and starting, with its text checked for a word.
inline DeviceFault fault_of_opening(const CameraOptions& options, const std::string& word) {
  try {
    V4l2Camera camera(options);
    camera.start();
  } catch (const DeviceError& error) {
    EXPECT_NE(std::string(error.what()).find(word), std::string::npos) << error.what();
    return error.fault();
  }
  ADD_FAILURE() << "opened without an error, expected: " << word;
  return DeviceFault::missing;
}

}  // namespace zeropose
