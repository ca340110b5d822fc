#include "protocol/can_socket.h"

#include <linux/can.h>
#include <linux/can/error.h>
#include <linux/can/raw.h>
#include <net/if.h>
#include <sys/ioctl.h>
#include <sys/socket.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <stdexcept>

#include "protocol/can_codec.h"

namespace zeropose {
namespace {

[[noreturn]] void fail(const std::string& interface, const std::string& what) {
  throw std::runtime_error("CAN " + interface + ": " + what);
}

[[noreturn]] void fail_of_system(const std::string& interface, const char* call) {
  fail(interface, std::string(call) + ": " + std::strerror(errno));
}

template <class Value>
void set(const Descriptor& socket, const std::string& interface, int level, int option, const Value& value) {
  if (setsockopt(socket.get(), level, option, &value, sizeof value) != 0)
    fail_of_system(interface, "setsockopt");
}

ifreq request_for(const std::string& interface) {
  ifreq request{};
  std::copy_n(interface.begin(), std::min(interface.size(), sizeof request.ifr_name - 1), request.ifr_name);
  return request;
}

Descriptor open_raw(const std::string& interface) {
  Descriptor made(socket(PF_CAN, SOCK_RAW | SOCK_NONBLOCK | SOCK_CLOEXEC, CAN_RAW));
  if (!made && (errno == EAFNOSUPPORT || errno == EPROTONOSUPPORT))
    fail(interface, "this kernel has no CAN; load the modules: modprobe can-raw");
  if (!made) fail_of_system(interface, "socket");
  return made;
}

int index_of(const Descriptor& socket, const std::string& interface, bool fd) {
  ifreq request = request_for(interface);
  if (ioctl(socket.get(), SIOCGIFFLAGS, &request) != 0)
    fail(interface, "there is no such interface; see ip link");
  if (!(request.ifr_flags & IFF_UP))
    fail(interface,
         "the interface is down; ip link set " + interface + " up type can bitrate 500000 restart-ms 100");
  if (fd &&
      (ioctl(socket.get(), SIOCGIFMTU, &request) != 0 || request.ifr_mtu != static_cast<int>(CANFD_MTU)))
    fail(interface, "the interface is not set to CAN FD; ip link set " + interface + " type can ... fd on");
  request = request_for(interface);
  if (ioctl(socket.get(), SIOCGIFINDEX, &request) != 0) fail_of_system(interface, "SIOCGIFINDEX");
  return request.ifr_ifindex;
}

// Also extended and remote frames with these bits: they are counted.
void filter(const Descriptor& socket, const std::string& interface, std::uint32_t node) {
  constexpr std::array<std::uint32_t, 9> of_node = {
      can_id::emergency, can_id::tpdo1,      can_id::rpdo1,       can_id::tpdo2,    can_id::tpdo3,
      can_id::result_fd, can_id::sdo_answer, can_id::sdo_request, can_id::heartbeat};
  std::array<can_filter, of_node.size() + 1> filters{};
  for (std::size_t i = 0; i < of_node.size(); ++i) filters[i] = {of_node[i] + node, CAN_SFF_MASK};
  filters.back() = {can_id::nmt, CAN_SFF_MASK};
  set(socket, interface, SOL_CAN_RAW, CAN_RAW_FILTER, filters);
}

CanFrame frame_in(const canfd_frame& raw, bool fd) {
  CanFrame frame;
  frame.extended = (raw.can_id & CAN_EFF_FLAG) != 0;
  frame.remote = (raw.can_id & CAN_RTR_FLAG) != 0;
  frame.error = (raw.can_id & CAN_ERR_FLAG) != 0;
  frame.id = raw.can_id & (frame.extended || frame.error ? CAN_EFF_MASK : CAN_SFF_MASK);
  frame.fd = fd;
  frame.size = std::min<std::uint8_t>(raw.len, fd ? CANFD_MAX_DLEN : CAN_MAX_DLEN);
  std::copy_n(raw.data, frame.size, frame.data.begin());
  return frame;
}

}  // namespace

CanSocket::CanSocket(const std::string& interface, std::uint32_t node, bool fd)
    : socket_(open_raw(interface)) {
  const int index = index_of(socket_, interface, fd);
  const int on = 1;
  const can_err_mask_t errors = CAN_ERR_BUSOFF | CAN_ERR_RESTARTED;
  set(socket_, interface, SOL_CAN_RAW, CAN_RAW_RECV_OWN_MSGS, on);
  set(socket_, interface, SOL_CAN_RAW, CAN_RAW_ERR_FILTER, errors);
  if (fd) set(socket_, interface, SOL_CAN_RAW, CAN_RAW_FD_FRAMES, on);
  filter(socket_, interface, node);
  sockaddr_can address{};
  address.can_family = AF_CAN;
  address.can_ifindex = index;
  if (bind(socket_.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0)
    fail_of_system(interface, "bind");
}

CanIo CanSocket::receive(CanReceived& received) {
  canfd_frame raw{};
  iovec part{&raw, sizeof raw};
  msghdr message{};
  message.msg_iov = &part;
  message.msg_iovlen = 1;
  const ssize_t size = recvmsg(socket_.get(), &message, MSG_DONTWAIT);
  if (size < 0)
    return errno == EAGAIN || errno == EWOULDBLOCK || errno == EINTR ? CanIo::nothing : CanIo::interface_gone;
  if (size != CAN_MTU && size != CANFD_MTU) return CanIo::nothing;
  received.frame = frame_in(raw, size == CANFD_MTU);
  received.own_echo = (message.msg_flags & MSG_CONFIRM) != 0;
  return CanIo::done;
}

CanIo CanSocket::send(const CanFrame& frame) {
  canfd_frame raw{};
  raw.can_id = frame.id;
  raw.len = frame.size;
  if (frame.fd) raw.flags = CANFD_BRS;
  std::copy_n(frame.data.begin(), frame.size, raw.data);
  const ssize_t size = frame.fd ? CANFD_MTU : CAN_MTU;
  if (write(socket_.get(), &raw, static_cast<std::size_t>(size)) == size) return CanIo::done;
  const bool gone = errno == ENETDOWN || errno == ENODEV || errno == ENXIO || errno == EBADF;
  return gone ? CanIo::interface_gone : CanIo::no_room;
}

}  // namespace zeropose
