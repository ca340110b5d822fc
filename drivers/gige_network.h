// What can be said about a GigE Vision camera without the library: which network interface leads to it, how
// large its packets may be, whether it answers. None of it blocks longer than it is told.
#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <string>

namespace zeropose {

struct NetworkInterface {
  std::string name;
  std::string address;  // IPv4, of this machine
  int mtu_bytes = 0;
  bool loopback = false;
};

// The one wanted by name, with its address in the camera's network if it has several; without a name by
// asking the routing table. Sends nothing. Throws DeviceError when the address is none, no route leads to it
// or there is no such interface.
NetworkInterface interface_towards(const std::string& address, const std::string& wanted = {});

// The largest stream packet worth trying on an interface, IP header included: never above its MTU (a larger
// one gives wrong pixels without an error), nor above a jumbo frame.
int largest_packet_bytes(const NetworkInterface& interface);

// Whether this process may have a UDP receive buffer of that size: by its rights or by net.core.rmem_max.
bool receive_buffer_allowed(int bytes);

// Whether this process may read whole packets below UDP (CAP_NET_RAW).
bool packet_socket_allowed();

// Reads a bootstrap register by one GVCP request, repeated while there is time (GigE Vision 2.0, READREG).
// nullopt: no answer. A device that answers but refuses gives 0. Throws DeviceError as above.
std::optional<std::uint32_t> read_register(const std::string& camera_address, std::uint32_t register_address,
                                           std::chrono::milliseconds within);

}  // namespace zeropose
