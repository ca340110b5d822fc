#include "protocol/modbus_socket.h"

#include <arpa/inet.h>
#include <netinet/tcp.h>
#include <sys/socket.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <stdexcept>

namespace zeropose {
namespace {

in_addr_t parse(const std::string& address) {
  in_addr parsed{};
  if (inet_pton(AF_INET, address.c_str(), &parsed) != 1)
    throw std::invalid_argument("Modbus: \"" + address +
                                "\" is no numeric IPv4 address such as 192.168.0.10");
  return parsed.s_addr;
}

std::vector<in_addr_t> parse_all(const std::vector<std::string>& addresses) {
  std::vector<in_addr_t> parsed;
  parsed.reserve(addresses.size());
  for (const std::string& address : addresses) parsed.push_back(parse(address));
  return parsed;
}

bool contains(const std::vector<in_addr_t>& list, in_addr_t peer) {
  return std::ranges::find(list, peer) != list.end();
}

std::string remedy(int error) {
  switch (error) {
    case EACCES:
      return "choose a port above 1023, or give the service CAP_NET_BIND_SERVICE";
    case EADDRINUSE:
      return "another program listens there: stop it, or choose another port";
    case EADDRNOTAVAIL:
      return "no network interface has this address: correct it, or set up the interface first";
    default:
      return "see the cause";
  }
}

[[noreturn]] void fail(const std::string& address, std::uint16_t port, const char* call) {
  const int error = errno;
  throw std::runtime_error("Modbus: cannot listen on " + address + " port " + std::to_string(port) + " (" +
                           call + ": " + std::strerror(error) + "); " + remedy(error));
}

void set(int socket, int level, int name, int value) {
  setsockopt(socket, level, name, &value, sizeof value);
}

}  // namespace

Descriptor listen_on(const std::string& address, std::uint16_t port) {
  sockaddr_in name{};
  name.sin_family = AF_INET;
  name.sin_port = htons(port);
  name.sin_addr.s_addr = parse(address);
  Descriptor listener(socket(AF_INET, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0));
  if (!listener) fail(address, port, "socket");
  set(listener.get(), SOL_SOCKET, SO_REUSEADDR, 1);
  if (bind(listener.get(), reinterpret_cast<const sockaddr*>(&name), sizeof name) != 0)
    fail(address, port, "bind");
  if (listen(listener.get(), 128) != 0) fail(address, port, "listen");
  return listener;
}

std::uint16_t port_of(int listener) {
  sockaddr_in name{};
  socklen_t size = sizeof name;
  getsockname(listener, reinterpret_cast<sockaddr*>(&name), &size);
  return ntohs(name.sin_port);
}

std::optional<Accepted> accept_from(int listener) {
  sockaddr_in peer{};
  socklen_t size = sizeof peer;
  const int fd = accept4(listener, reinterpret_cast<sockaddr*>(&peer), &size, SOCK_NONBLOCK | SOCK_CLOEXEC);
  if (fd < 0) return std::nullopt;
  set(fd, IPPROTO_TCP, TCP_NODELAY, 1);
  set(fd, SOL_SOCKET, SO_KEEPALIVE, 1);
  set(fd, IPPROTO_TCP, TCP_KEEPIDLE, 1);
  set(fd, IPPROTO_TCP, TCP_KEEPINTVL, 1);
  set(fd, IPPROTO_TCP, TCP_KEEPCNT, 3);
  set(fd, IPPROTO_TCP, TCP_USER_TIMEOUT, 3000);
  return Accepted{Descriptor(fd), peer.sin_addr.s_addr};
}

AllowList::AllowList(const std::vector<std::string>& writers, const std::vector<std::string>& readers)
    : writers_(parse_all(writers)), readers_(parse_all(readers)) {}

AllowList::Role AllowList::role_of(in_addr_t peer) const {
  if (contains(writers_, peer)) return Role::writer;
  if (contains(readers_, peer)) return Role::reader;
  return writers_.empty() ? Role::writer : Role::none;
}

}  // namespace zeropose
