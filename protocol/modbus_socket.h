// The operating system's part of the Modbus server: listening, accepting, and who may come.
#pragma once

#include <netinet/in.h>

#include <optional>
#include <string>
#include <vector>

#include "protocol/line_socket.h"

namespace zeropose {

// Throws std::runtime_error that names address, port, cause and what to do.
Descriptor listen_on(const std::string& address, std::uint16_t port);
std::uint16_t port_of(int listener);

struct Accepted {
  Descriptor socket;
  in_addr_t peer = 0;
};
// Non-blocking, no delay, with keepalive so that a dead link is noticed within seconds. nullopt: nobody
// there, or the operating system refuses; errno tells.
std::optional<Accepted> accept_from(int listener);

// Who may read and who may write, by address.
class AllowList {
 public:
  enum class Role { none, reader, writer };
  // Throws std::invalid_argument naming an entry that is no numeric IPv4 address.
  AllowList(const std::vector<std::string>& writers, const std::vector<std::string>& readers);
  Role role_of(in_addr_t peer) const;
  const std::vector<in_addr_t>& writers() const { return writers_; }

 private:
  std::vector<in_addr_t> writers_, readers_;
};

}  // namespace zeropose
