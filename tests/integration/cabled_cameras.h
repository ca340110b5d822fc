// Four simulated GigE Vision cameras behind four network cables: veth pairs into a network of their own.
#pragma once

#include <string>
#include <vector>

#include "drivers/camera_options.h"

namespace zeropose {

class CabledCameras {
 public:
  static constexpr int count = 4, width_px = 1280, height_px = 1024;

  // Moves this process into a private network and starts the cameras in another process with another one.
  // Call before there are threads. Returns why it is impossible; empty: done. end() ends them.
  static std::string plug_in();
  static void end();

  static CameraOptions options(int camera);
  static void pull(int camera);
  static void plug(int camera);
  static void lose_packets(int camera, double ratio);  // 0..1 of the stream packets
};

}  // namespace zeropose
