// How a camera's stream comes over the network: size of its packets and kind of the socket.
#pragma once

#include <string>
#include <string_view>

#include "drivers/camera.h"
#include "drivers/gige_handles.h"
#include "drivers/gige_network.h"

namespace zeropose {

class GigePackets {
 public:
  static constexpr int socket_buffer_bytes = 4 << 20;

  // Both must outlive this.
  GigePackets(_ArvDevice* device, const CameraOptions& options) : device_(device), options_(options) {}

  // Before the stream is made. Throws DeviceError: the options do not fit the interface or our rights.
  void configure(const NetworkInterface& interface) const;

 private:
  void choose_socket() const;
  void set_packet_size(const NetworkInterface& interface) const;
  int wanted_packet_bytes(const NetworkInterface& interface) const;
  int tested_packet_bytes(const NetworkInterface& interface) const;
  void require(const GigeError& error, std::string_view doing) const;
  [[noreturn]] void fail(const std::string& what) const;

  _ArvDevice* device_;
  const CameraOptions& options_;
};

}  // namespace zeropose
