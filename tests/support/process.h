// Child processes and systemd's notify socket for tests of whole programs.
#pragma once

#include <sys/types.h>

#include <chrono>
#include <condition_variable>
#include <deque>
#include <filesystem>
#include <mutex>
#include <optional>
#include <stop_token>
#include <string>
#include <thread>
#include <vector>

namespace zeropose {

// A program that is killed at the latest when its owner goes.
class Process {
 public:
  // Starts it with these additional variables ("NAME=value"); its output goes to `log`.
  Process(const std::vector<std::string>& command, const std::filesystem::path& log,
          const std::vector<std::string>& environment = {});
  ~Process();
  Process(const Process&) = delete;
  Process& operator=(const Process&) = delete;

  void signal(int number);
  // The exit status (128 + signal when killed), nullopt when it still runs after the patience.
  std::optional<int> wait(std::chrono::milliseconds patience);

 private:
  pid_t pid_ = -1;
  std::optional<int> status_;
};

// Where this test's program is, and the programs it was built with.
std::filesystem::path program_folder();

struct Finished {
  int status = -1;
  std::string out, err;
};

// Runs a program to its end.
Finished run_program(const std::vector<std::string>& command,
                     std::chrono::seconds patience = std::chrono::seconds(60));

// What systemd would hear on $NOTIFY_SOCKET. Listens all the time, as systemd does: else a program that
// speaks would wait for it.
class NotifyListener {
 public:
  explicit NotifyListener(const std::filesystem::path& socket);
  ~NotifyListener();
  NotifyListener(const NotifyListener&) = delete;
  NotifyListener& operator=(const NotifyListener&) = delete;

  // Waits until a line like "READY=1" comes; true for each that came only once.
  bool heard(const std::string& line, std::chrono::milliseconds patience);

 private:
  void listen(const std::stop_token& stop);

  int fd_ = -1;
  std::mutex mutex_;
  std::condition_variable came_;
  std::deque<std::string> lines_;
  std::jthread thread_;
};

}  // namespace zeropose
