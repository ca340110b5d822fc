#include "tests/support/netns.h"

#include <arpa/inet.h>
#include <linux/netlink.h>
#include <linux/rtnetlink.h>
#include <net/if.h>
#include <sched.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <fstream>
#include <stdexcept>

namespace zeropose {
namespace {

class Socket {
 public:
  Socket(int family, int type, int protocol) : fd_(::socket(family, type | SOCK_CLOEXEC, protocol)) {
    if (fd_ < 0) fail("socket");
  }
  ~Socket() { ::close(fd_); }
  Socket(const Socket&) = delete;
  Socket& operator=(const Socket&) = delete;
  int fd() const { return fd_; }

  [[noreturn]] static void fail(const std::string& what) {
    throw std::runtime_error(what + ": " + std::strerror(errno));
  }

 private:
  int fd_;
};

void write_file(const char* path, const std::string& text) {
  std::ofstream file(path);
  file << text << std::flush;
  if (!file) Socket::fail(path);
}

void leave_network() {
  if (::geteuid() == 0) {
    if (::unshare(CLONE_NEWNET) != 0) Socket::fail("unshare(CLONE_NEWNET)");
    return;
  }
  const std::string uid = std::to_string(::geteuid()), gid = std::to_string(::getegid());
  if (::unshare(CLONE_NEWUSER | CLONE_NEWNET) != 0) Socket::fail("unshare(CLONE_NEWUSER | CLONE_NEWNET)");
  write_file("/proc/self/setgroups", "deny");
  write_file("/proc/self/uid_map", "0 " + uid + " 1");
  write_file("/proc/self/gid_map", "0 " + gid + " 1");
}

void bring_loopback_up() {
  const Socket socket(AF_INET, SOCK_DGRAM, 0);
  ifreq request{};
  std::strcpy(request.ifr_name, "lo");
  request.ifr_flags = IFF_UP | IFF_RUNNING;
  if (::ioctl(socket.fd(), SIOCSIFFLAGS, &request) != 0) Socket::fail("lo up");
}

// As `ip addr add ADDRESS/8 dev lo`: an alias by ioctl would get a name of its own.
void add_address(const std::string& address) {
  struct {
    nlmsghdr header{};
    ifaddrmsg message{};
    rtattr attribute{};
    in_addr local{};
  } request;
  request.header.nlmsg_len = sizeof request;
  request.header.nlmsg_type = RTM_NEWADDR;
  request.header.nlmsg_flags = NLM_F_REQUEST | NLM_F_ACK | NLM_F_CREATE | NLM_F_REPLACE;
  request.message.ifa_family = AF_INET;
  request.message.ifa_prefixlen = 8;
  request.message.ifa_scope = RT_SCOPE_HOST;
  request.message.ifa_index = ::if_nametoindex("lo");
  request.attribute.rta_len = RTA_LENGTH(sizeof(in_addr));
  request.attribute.rta_type = IFA_LOCAL;
  if (::inet_pton(AF_INET, address.c_str(), &request.local) != 1)
    throw std::runtime_error("not an IPv4 address: " + address);
  const Socket socket(AF_NETLINK, SOCK_RAW, NETLINK_ROUTE);
  if (::send(socket.fd(), &request, sizeof request, 0) < 0) Socket::fail("add " + address);
  struct {
    nlmsghdr header{};
    nlmsgerr error{};
  } reply;
  if (::recv(socket.fd(), &reply, sizeof reply, 0) < 0) Socket::fail("add " + address);
  errno = -reply.error.error;
  if (errno != 0) Socket::fail("add " + address);
}

}  // namespace

std::string enter_private_network(std::span<const std::string> addresses) {
  try {
    leave_network();
    bring_loopback_up();
    for (const std::string& address : addresses) add_address(address);
    return "";
  } catch (const std::runtime_error& error) {
    return std::string("no private network: ") + error.what();
  }
}

}  // namespace zeropose
