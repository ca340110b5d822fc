#include "protocol/line_socket.h"

#include <fcntl.h>
#include <poll.h>
#include <sys/eventfd.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <optional>
#include <stdexcept>

namespace zeropose {
namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;

constexpr std::size_t longest_line = 1 << 24;
constexpr auto client_patience = 5s;  // a client that sends no whole line within this is closed

[[noreturn]] void fail(const std::filesystem::path& socket, const std::string& what) {
  throw std::runtime_error(socket.string() + ": " + what + ": " + std::strerror(errno));
}

sockaddr_un address_of(const std::filesystem::path& socket) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  if (socket.string().size() >= sizeof address.sun_path)
    throw std::runtime_error(socket.string() + ": path is too long for a socket (107 characters at most)");
  std::strncpy(address.sun_path, socket.c_str(), sizeof address.sun_path - 1);
  return address;
}

bool connect_to(int fd, const sockaddr_un& address) {
  return ::connect(fd, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0;
}

bool wait_for(int fd, short events, Clock::time_point deadline) {
  const auto left = std::chrono::ceil<std::chrono::milliseconds>(deadline - Clock::now());
  pollfd entry{fd, events, 0};
  return left > 0ms && ::poll(&entry, 1, static_cast<int>(left.count())) > 0;
}

// One line without its end; nullopt at the deadline, at the end of the stream and when it is too long.
std::optional<std::string> read_line(int fd, std::string& rest, Clock::time_point deadline) {
  for (;;) {
    if (const auto end = rest.find('\n'); end != std::string::npos) {
      std::string line = rest.substr(0, end);
      rest.erase(0, end + 1);
      return line;
    }
    if (rest.size() > longest_line || !wait_for(fd, POLLIN, deadline)) return std::nullopt;
    char part[65536];
    const ssize_t size = ::recv(fd, part, sizeof part, MSG_DONTWAIT);
    if (size == 0 || (size < 0 && errno != EAGAIN && errno != EINTR)) return std::nullopt;
    if (size > 0) rest.append(part, static_cast<std::size_t>(size));
  }
}

bool write_all(int fd, std::string_view text, Clock::time_point deadline) {
  while (!text.empty()) {
    const ssize_t size = ::send(fd, text.data(), text.size(), MSG_NOSIGNAL | MSG_DONTWAIT);
    if (size > 0)
      text.remove_prefix(static_cast<std::size_t>(size));
    else if ((errno != EAGAIN && errno != EINTR) || !wait_for(fd, POLLOUT, deadline))
      return false;
  }
  return true;
}

}  // namespace

Descriptor::~Descriptor() {
  if (fd_ >= 0) ::close(fd_);
}

LineServer::LineServer(std::filesystem::path socket, Answer answer)
    : socket_(std::move(socket)), answer_(std::move(answer)) {
  const sockaddr_un address = address_of(socket_);
  if (socket_.has_parent_path()) std::filesystem::create_directories(socket_.parent_path());
  const Descriptor probe(::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0));
  if (connect_to(probe.get(), address))
    throw std::runtime_error(socket_.string() +
                             ": another process already serves this socket; stop it or choose another path");
  const bool refused = errno == ECONNREFUSED;
  if (std::filesystem::exists(socket_) && !std::filesystem::is_socket(socket_))
    throw std::runtime_error(socket_.string() + ": is there already and no socket; choose another path");
  if (refused) ::unlink(socket_.c_str());

  listener_ = Descriptor(::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
  stop_ = Descriptor(::eventfd(0, EFD_CLOEXEC));
  if (!listener_ || !stop_) fail(socket_, "cannot create the socket");
  listen_there();
  thread_ = std::thread([this] { serve(); });
}

// Whoever finds the socket can connect: it gets its name when it listens, and nobody else's.
void LineServer::listen_there() {
  const std::filesystem::path unnamed = socket_.parent_path() / (std::to_string(::getpid()) + ".new");
  const sockaddr_un address = address_of(unnamed);
  ::unlink(unnamed.c_str());
  if (::bind(listener_.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0)
    fail(unnamed, "cannot bind");
  ::chmod(unnamed.c_str(), 0660);
  if (::listen(listener_.get(), 8) == 0 &&
      ::renameat2(AT_FDCWD, unnamed.c_str(), AT_FDCWD, socket_.c_str(), RENAME_NOREPLACE) == 0)
    return;
  const int error = errno;
  ::unlink(unnamed.c_str());
  errno = error;
  fail(socket_, "cannot serve this socket");
}

LineServer::~LineServer() {
  const std::uint64_t one = 1;
  if (::write(stop_.get(), &one, sizeof one) != sizeof one) std::terminate();
  thread_.join();
  ::unlink(socket_.c_str());
}

void LineServer::serve() {
  for (;;) {
    pollfd entries[] = {{listener_.get(), POLLIN, 0}, {stop_.get(), POLLIN, 0}};
    if (::poll(entries, 2, -1) < 0 && errno != EINTR) return;
    if (entries[1].revents != 0) return;
    const Descriptor client(::accept4(listener_.get(), nullptr, nullptr, SOCK_CLOEXEC));
    if (client) serve_client(client.get());
  }
}

void LineServer::serve_client(int client) {
  std::string rest;
  while (const auto line = read_line(client, rest, Clock::now() + client_patience))
    if (!write_all(client, answer_(*line) + '\n', Clock::now() + client_patience)) return;
}

std::string ask(const std::filesystem::path& socket, std::string_view line,
                std::chrono::milliseconds timeout) {
  const sockaddr_un address = address_of(socket);
  const auto deadline = Clock::now() + timeout;
  const Descriptor server(::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0));
  if (!server) fail(socket, "cannot create a socket");
  if (!connect_to(server.get(), address)) fail(socket, "cannot connect (is the program running?)");
  std::string rest;
  if (!write_all(server.get(), std::string(line) + '\n', deadline)) fail(socket, "cannot send");
  const auto answer = read_line(server.get(), rest, deadline);
  if (!answer)
    throw std::runtime_error(socket.string() + ": no answer within " + std::to_string(timeout.count()) +
                             " ms");
  return *answer;
}

}  // namespace zeropose
