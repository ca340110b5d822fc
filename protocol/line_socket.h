// A Unix socket on which each line is one question and gets one line as its answer: for the command line and
// the simulated cell, never for a robot.
#pragma once

#include <chrono>
#include <filesystem>
#include <functional>
#include <string>
#include <string_view>
#include <thread>
#include <utility>

namespace zeropose {

// Removes the descriptor when it goes: move-only owner.
class Descriptor {
 public:
  explicit Descriptor(int fd = -1) noexcept : fd_(fd) {}
  Descriptor(Descriptor&& other) noexcept : fd_(std::exchange(other.fd_, -1)) {}
  Descriptor& operator=(Descriptor&& other) noexcept {
    std::swap(fd_, other.fd_);
    return *this;
  }
  ~Descriptor();
  int get() const { return fd_; }
  explicit operator bool() const { return fd_ >= 0; }

 private:
  int fd_;
};

// Answers one client after the other in a thread of its own. The socket is readable and writable by its owner
// and group only.
class LineServer {
 public:
  using Answer = std::function<std::string(const std::string& line)>;

  // Creates the directory where missing; takes over a socket file that nobody serves any more.
  // Throws std::runtime_error when the socket cannot be made or somebody serves it.
  LineServer(std::filesystem::path socket, Answer answer);
  ~LineServer();
  LineServer(const LineServer&) = delete;
  LineServer& operator=(const LineServer&) = delete;

 private:
  void listen_there();
  void serve();
  void serve_client(int client);

  std::filesystem::path socket_;
  Answer answer_;
  Descriptor listener_, stop_;
  std::thread thread_;
};

// Sends one line and returns the answer without its line end. Throws std::runtime_error naming socket and
// cause.
std::string ask(const std::filesystem::path& socket, std::string_view line,
                std::chrono::milliseconds timeout);

}  // namespace zeropose
