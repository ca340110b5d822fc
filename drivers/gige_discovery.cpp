#include "drivers/gige_discovery.h"

#include <arpa/inet.h>
#include <ifaddrs.h>
#include <net/if.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cerrno>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <memory>
#include <span>
#include <tuple>

#include "drivers/camera.h"
#include "drivers/udp_socket.h"

namespace zeropose {
namespace {

using std::chrono::milliseconds;
using std::chrono::steady_clock;

constexpr std::uint16_t control_port = 3956;  // GigE Vision 2.0, GVCP
constexpr milliseconds repeat{250};           // a broadcast may be lost

// DISCOVERY_CMD: acknowledge wanted, also by broadcast, as a camera with a foreign address must send it.
constexpr std::array<std::uint8_t, 8> question = {0x42, 0x11, 0x00, 0x02, 0x00, 0x00, 0xff, 0xff};
constexpr std::array<std::uint8_t, 2> answer_command = {0x00, 0x03};
constexpr std::size_t header_bytes = 8;
// What follows is the beginning of the bootstrap registers.
constexpr std::size_t mac_at = 0x0a, address_at = 0x24, vendor_at = 0x48, model_at = 0x68, serial_at = 0xd8,
                      user_name_at = 0xe8, answer_bytes = 0xf8;

struct Asked {
  std::string interface;
  std::vector<in_addr> broadcasts;
  UdpSocket socket;
};

// Bound to the interface, it also hears acknowledges by broadcast. An old kernel refuses that to an ordinary
// user: then it is bound to the interface's address, which all cameras of its network can answer.
void bind_to(const Asked& asked, in_addr own_address) {
  const int yes = 1, fd = asked.socket.fd();
  ::setsockopt(fd, SOL_SOCKET, SO_BROADCAST, &yes, sizeof yes);
  sockaddr_in here{};
  here.sin_family = AF_INET;
  if (::setsockopt(fd, SOL_SOCKET, SO_BINDTODEVICE, asked.interface.c_str(),
                   static_cast<socklen_t>(asked.interface.size())) != 0)
    here.sin_addr = own_address;
  if (::bind(fd, std::bit_cast<sockaddr*>(&here), sizeof here) != 0)
    throw DeviceError("interface " + asked.interface + " cannot be searched: " + std::strerror(errno));
}

in_addr ipv4_of(const sockaddr* address) {
  sockaddr_in ipv4{};
  std::memcpy(&ipv4, address, sizeof ipv4);
  return ipv4.sin_addr;
}

// A loopback has no broadcast address of its own: the last one of its network does.
in_addr broadcast_of(const ifaddrs& entry) {
  in_addr broadcast = ipv4_of(entry.ifa_addr);
  broadcast.s_addr |= ~ipv4_of(entry.ifa_netmask).s_addr;
  return broadcast;
}

std::vector<Asked> interfaces(const std::string& only) {
  ifaddrs* list = nullptr;
  if (::getifaddrs(&list) != 0)
    throw DeviceError(std::string("network interfaces cannot be listed: ") + std::strerror(errno));
  const std::unique_ptr<ifaddrs, decltype(&::freeifaddrs)> owner(list, &::freeifaddrs);
  std::vector<Asked> all;
  for (const ifaddrs* entry = list; entry != nullptr; entry = entry->ifa_next) {
    if (entry->ifa_addr == nullptr || entry->ifa_addr->sa_family != AF_INET || entry->ifa_netmask == nullptr)
      continue;
    const std::string device = entry->ifa_name;
    const std::string name = device.substr(0, device.find(':'));  // an alias is called eth0:1
    if ((entry->ifa_flags & IFF_UP) == 0 || (!only.empty() && name != only)) continue;
    const in_addr broadcast = broadcast_of(*entry);
    const auto known = std::ranges::find(all, name, &Asked::interface);
    if (known != all.end()) {
      known->broadcasts.push_back(broadcast);
      continue;
    }
    all.push_back({name, {in_addr{INADDR_BROADCAST}, broadcast}, UdpSocket()});
    bind_to(all.back(), ipv4_of(entry->ifa_addr));
  }
  if (all.empty() && !only.empty())
    throw DeviceError("network interface " + only +
                      " is missing, down or without an IPv4 address; `ip addr` "
                      "shows them");
  return all;
}

void ask(const Asked& asked) {
  for (const in_addr broadcast : asked.broadcasts) {
    sockaddr_in there{};
    there.sin_family = AF_INET;
    there.sin_port = htons(control_port);
    there.sin_addr = broadcast;
    // An interface without a route for it, or a cable that is unplugged: no camera answers there.
    (void)::sendto(asked.socket.fd(), question.data(), question.size(), 0, std::bit_cast<sockaddr*>(&there),
                   sizeof there);
  }
}

std::string text_at(std::span<const std::uint8_t> registers, std::size_t at, std::size_t most) {
  const auto field = registers.subspan(at, most);
  return {field.begin(), std::ranges::find(field, std::uint8_t{0})};
}

std::optional<FoundGigeCamera> read_answer(std::span<const std::uint8_t> packet) {
  if (packet.size() < header_bytes + answer_bytes) return std::nullopt;
  if (packet[0] != 0 || packet[1] != 0 || !std::ranges::equal(packet.subspan(2, 2), answer_command))
    return std::nullopt;
  const auto registers = packet.subspan(header_bytes);
  const auto* mac = &registers[mac_at];
  const auto* ip = &registers[address_at];
  char mac_text[18], address[16];
  std::snprintf(mac_text, sizeof mac_text, "%02x:%02x:%02x:%02x:%02x:%02x", mac[0], mac[1], mac[2], mac[3],
                mac[4], mac[5]);
  std::snprintf(address, sizeof address, "%u.%u.%u.%u", ip[0], ip[1], ip[2], ip[3]);
  return FoundGigeCamera{.vendor = text_at(registers, vendor_at, 32),
                         .model = text_at(registers, model_at, 32),
                         .serial = text_at(registers, serial_at, 16),
                         .user_name = text_at(registers, user_name_at, 16),
                         .address = address,
                         .mac = mac_text,
                         .interface = {}};
}

using Found = std::function<bool(FoundGigeCamera)>;  // returns whether that is enough

bool read_answers(const Asked& asked, const Found& found) {
  std::array<std::uint8_t, 1024> packet;
  for (;;) {
    const ssize_t bytes = ::recv(asked.socket.fd(), packet.data(), packet.size(), MSG_DONTWAIT);
    if (bytes < 0) return false;
    auto camera = read_answer({packet.data(), static_cast<std::size_t>(bytes)});
    if (!camera) continue;
    camera->interface = asked.interface;
    if (found(std::move(*camera))) return true;
  }
}

void listen_for_answers(milliseconds within, const std::string& only_interface, const Found& found) {
  const std::vector<Asked> all = interfaces(only_interface);
  std::vector<pollfd> wanted;
  for (const Asked& asked : all) wanted.push_back({asked.socket.fd(), POLLIN, 0});
  const TimePoint end = steady_clock::now() + within;
  TimePoint ask_at = TimePoint::min();
  for (TimePoint now = steady_clock::now(); now < end; now = steady_clock::now()) {
    if (now >= ask_at) {
      for (const Asked& asked : all) ask(asked);
      ask_at = now + repeat;
    }
    const auto left = std::chrono::ceil<milliseconds>(std::min(end, ask_at) - now);
    if (::poll(wanted.data(), wanted.size(), static_cast<int>(left.count())) <= 0) continue;
    for (std::size_t i = 0; i < all.size(); ++i)
      if (wanted[i].revents != 0 && read_answers(all[i], found)) return;
  }
}

auto key_of(const FoundGigeCamera& camera) {
  in_addr address{};
  ::inet_pton(AF_INET, camera.address.c_str(), &address);
  return std::tuple(ntohl(address.s_addr), camera.interface, camera.mac, camera.serial);
}

}  // namespace

std::vector<FoundGigeCamera> discover_gige(milliseconds within, const std::string& only_interface) {
  std::vector<FoundGigeCamera> cameras;
  listen_for_answers(within, only_interface, [&](FoundGigeCamera camera) {
    if (std::ranges::find(cameras, key_of(camera), key_of) == cameras.end())
      cameras.push_back(std::move(camera));
    return false;
  });
  std::ranges::sort(cameras, {}, key_of);
  return cameras;
}

std::optional<FoundGigeCamera> find_gige(milliseconds within, const std::string& only_interface,
                                         const std::function<bool(const FoundGigeCamera&)>& wanted) {
  std::optional<FoundGigeCamera> match;
  listen_for_answers(within, only_interface, [&](FoundGigeCamera camera) {
    if (!wanted(camera)) return false;
    match = std::move(camera);
    return true;
  });
  return match;
}

}  // namespace zeropose
