#include "drivers/gige_network.h"

#include <arpa/inet.h>
#include <ifaddrs.h>
#include <net/if.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <bit>
#include <cerrno>
#include <cstring>
#include <memory>

#include "drivers/camera.h"
#include "drivers/udp_socket.h"

namespace zeropose {
namespace {

constexpr std::uint16_t control_port = 3956;  // GigE Vision 2.0, GVCP
constexpr int jumbo_bytes = 9000;

in_addr parse(const std::string& address) {
  in_addr parsed{};
  if (::inet_pton(AF_INET, address.c_str(), &parsed) != 1)
    throw DeviceError("camera address '" + address +
                      "' is not an IPv4 address; give four numbers like 192.168.1.11");
  return parsed;
}

void connect_to(const UdpSocket& socket, const std::string& address) {
  sockaddr_in there{};
  there.sin_family = AF_INET;
  there.sin_port = htons(control_port);
  there.sin_addr = parse(address);
  if (::connect(socket.fd(), std::bit_cast<sockaddr*>(&there), sizeof there) != 0)
    throw DeviceError("no route to camera " + address + " (" + std::strerror(errno) +
                      "); check the network interface of the cameras");
}

// The address that this machine would send from.
in_addr source_towards(const UdpSocket& socket, const std::string& address) {
  connect_to(socket, address);
  sockaddr_in here{};
  socklen_t size = sizeof here;
  if (::getsockname(socket.fd(), std::bit_cast<sockaddr*>(&here), &size) != 0)
    throw DeviceError("no local address towards camera " + address + ": " + std::strerror(errno));
  return here.sin_addr;
}

in_addr ipv4_of(const sockaddr* address) {
  sockaddr_in ipv4{};
  std::memcpy(&ipv4, address, sizeof ipv4);
  return ipv4.sin_addr;
}

bool in_network(const ifaddrs& interface, in_addr address) {
  if (interface.ifa_netmask == nullptr) return false;
  const in_addr_t mask = ipv4_of(interface.ifa_netmask).s_addr;
  return ((ipv4_of(interface.ifa_addr).s_addr ^ address.s_addr) & mask) == 0;
}

int mtu_of(const UdpSocket& socket, const std::string& name) {
  ifreq request{};
  name.copy(request.ifr_name, IFNAMSIZ - 1);
  if (::ioctl(socket.fd(), SIOCGIFMTU, &request) != 0)
    throw DeviceError("MTU of interface " + name + " unknown: " + std::strerror(errno));
  return request.ifr_mtu;
}

constexpr std::uint8_t message_key = 0x42, acknowledge_wanted = 0x01;
constexpr std::uint16_t read_register_command = 0x0080, read_register_answer = 0x0081;

// All in network byte order.
struct ReadRequest {
  std::uint8_t key = message_key, flags = acknowledge_wanted;
  std::uint16_t command = htons(read_register_command);
  std::uint16_t length = htons(sizeof(std::uint32_t));
  std::uint16_t id = 0;
  std::uint32_t address = 0;
};

struct ReadAnswer {
  std::uint16_t status = 0, answer = 0, length = 0, id = 0;
  std::uint32_t value = 0;
};

// The answer to request `id` that comes until then; others are passed over.
std::optional<ReadAnswer> await(const UdpSocket& socket, std::uint16_t id, TimePoint until) {
  using std::chrono::milliseconds;
  while (true) {
    const auto left = std::chrono::ceil<milliseconds>(until - std::chrono::steady_clock::now());
    if (left.count() <= 0) return std::nullopt;
    pollfd wanted{socket.fd(), POLLIN, 0};
    if (::poll(&wanted, 1, static_cast<int>(left.count())) <= 0) continue;
    ReadAnswer answer;
    // A port that nobody serves is reported here as an error: then the rest of the time is waited for.
    const ssize_t bytes = ::recv(socket.fd(), &answer, sizeof answer, MSG_DONTWAIT);
    constexpr ssize_t header_bytes = 8;
    if (bytes >= header_bytes && answer.answer == htons(read_register_answer) && answer.id == id)
      return answer;
  }
}

}  // namespace

bool receive_buffer_allowed(int bytes) {
  const UdpSocket socket;
  if (::setsockopt(socket.fd(), SOL_SOCKET, SO_RCVBUFFORCE, &bytes, sizeof bytes) == 0) return true;
  ::setsockopt(socket.fd(), SOL_SOCKET, SO_RCVBUF, &bytes, sizeof bytes);
  int got = 0;
  socklen_t size = sizeof got;
  ::getsockopt(socket.fd(), SOL_SOCKET, SO_RCVBUF, &got, &size);
  return got / 2 >= bytes;  // the kernel doubles what it is asked for
}

bool packet_socket_allowed() {
  const int fd = ::socket(AF_PACKET, SOCK_RAW | SOCK_CLOEXEC, 0);
  if (fd >= 0) ::close(fd);
  return fd >= 0;
}

NetworkInterface interface_towards(const std::string& address, const std::string& wanted) {
  const UdpSocket socket;
  const in_addr there = parse(address);
  const in_addr source = wanted.empty() ? source_towards(socket, address) : in_addr{};
  ifaddrs* list = nullptr;
  if (::getifaddrs(&list) != 0)
    throw DeviceError(std::string("network interfaces cannot be listed: ") + std::strerror(errno));
  const std::unique_ptr<ifaddrs, decltype(&::freeifaddrs)> owner(list, &::freeifaddrs);
  const ifaddrs* best = nullptr;
  for (const ifaddrs* entry = list; entry != nullptr; entry = entry->ifa_next) {
    if (entry->ifa_addr == nullptr || entry->ifa_addr->sa_family != AF_INET) continue;
    const bool wanted_one =
        wanted.empty() ? ipv4_of(entry->ifa_addr).s_addr == source.s_addr : wanted == entry->ifa_name;
    if (wanted_one && (best == nullptr || (!in_network(*best, there) && in_network(*entry, there))))
      best = entry;
  }
  if (best == nullptr && wanted.empty())
    throw DeviceError("no network interface of this machine leads to camera " + address);
  if (best == nullptr)
    throw DeviceError("network interface " + wanted +
                      " is missing or without an IPv4 address; correct "
                      "network.interface in the cell file, `ip addr` shows what there is");
  char text[INET_ADDRSTRLEN] = {};
  const in_addr own = ipv4_of(best->ifa_addr);
  ::inet_ntop(AF_INET, &own, text, sizeof text);
  return {best->ifa_name, text, mtu_of(socket, best->ifa_name), (best->ifa_flags & IFF_LOOPBACK) != 0};
}

int largest_packet_bytes(const NetworkInterface& interface) {
  return std::min(interface.mtu_bytes, jumbo_bytes);
}

std::optional<std::uint32_t> read_register(const std::string& camera_address, std::uint32_t register_address,
                                           std::chrono::milliseconds within) {
  static std::atomic<std::uint16_t> next_id = 1;
  constexpr std::chrono::milliseconds repeat{100};
  const UdpSocket socket;
  connect_to(socket, camera_address);
  ReadRequest request;
  request.id = htons(std::max<std::uint16_t>(1, next_id++));  // 0 is none
  request.address = htonl(register_address);
  const TimePoint end = std::chrono::steady_clock::now() + within;
  for (TimePoint now = end - within; now < end; now = std::chrono::steady_clock::now()) {
    if (::send(socket.fd(), &request, sizeof request, 0) < 0 && errno != ECONNREFUSED) return std::nullopt;
    const auto answer = await(socket, request.id, std::min(end, now + repeat));
    if (answer) return answer->status == 0 ? ntohl(answer->value) : 0;
  }
  return std::nullopt;
}

}  // namespace zeropose
