// The kernel's CAN socket, non-blocking. Internal to CanLink.
#pragma once

#include <optional>
#include <string>

#include "protocol/can_frame.h"
#include "protocol/line_socket.h"

namespace zeropose {

struct CanReceived {
  CanFrame frame;
  bool own_echo = false;  // sent by this very socket
};

enum class CanIo { done, nothing, interface_gone, no_room };

class CanSocket {
 public:
  // Takes in only what concerns this node, and error frames of bus-off. Throws std::runtime_error, with what
  // to do, when there is no such interface or it is not up.
  CanSocket(const std::string& interface, std::uint32_t node, bool fd);

  int descriptor() const { return socket_.get(); }
  CanIo receive(CanReceived& received);
  CanIo send(const CanFrame& frame);

 private:
  Descriptor socket_;
};

}  // namespace zeropose
