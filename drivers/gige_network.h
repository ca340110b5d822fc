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

// By asking the routing table; sends nothing. Throws DeviceError when the address is none or no route leads
// to it.
NetworkInterface interface_towards(const std::string& address);

// The largest stream packet worth trying on an interface, IP header included: never above its MTU (a larger
// one gives wrong pixels without an error), nor above a jumbo frame.
int largest_packet_bytes(const NetworkInterface& interface);

// Whether this process may have a UDP receive buffer of that size: by its rights or by net.core.rmem_max.
bool receive_buffer_allowed(int bytes);

// Reads a bootstrap register by one GVCP request, repeated while there is time (GigE Vision 2.0, READREG).
// nullopt: no answer. A device that answers but refuses gives 0. Throws DeviceError as above.
std::optional<std::uint32_t> read_register(const std::string& camera_address, std::uint32_t register_address,
                                           std::chrono::milliseconds within);

}  // namespace zeropose
