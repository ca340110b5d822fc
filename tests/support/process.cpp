#include "tests/support/process.h"

#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstring>
#include <fstream>
#include <sstream>
#include <stdexcept>
#include <thread>

namespace zeropose {
namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;

std::vector<char*> pointers(const std::vector<std::string>& texts) {
  std::vector<char*> result;
  for (const auto& text : texts) result.push_back(const_cast<char*>(text.c_str()));
  result.push_back(nullptr);
  return result;
}

std::vector<std::string> with_environment(const std::vector<std::string>& more) {
  std::vector<std::string> all(more);
  for (char** variable = environ; *variable; ++variable) all.emplace_back(*variable);
  return all;
}

pid_t spawn(const std::vector<std::string>& command, const std::filesystem::path& out,
            const std::filesystem::path& err, const std::vector<std::string>& environment) {
  const auto variables = with_environment(environment);
  const auto arguments = pointers(command), variable_pointers = pointers(variables);
  const pid_t pid = ::fork();
  if (pid != 0) return pid;
  sigset_t none;
  sigemptyset(&none);
  ::sigprocmask(SIG_SETMASK, &none, nullptr);
  const int out_fd = ::open(out.c_str(), O_CREAT | O_WRONLY | O_APPEND, 0644);
  const int err_fd = ::open(err.c_str(), O_CREAT | O_WRONLY | O_APPEND, 0644);
  ::dup2(out_fd, STDOUT_FILENO);
  ::dup2(err_fd, STDERR_FILENO);
  ::execve(arguments[0], arguments.data(), variable_pointers.data());
  ::_exit(127);
}

std::string content(const std::filesystem::path& path) {
  std::stringstream text;
  text << std::ifstream(path).rdbuf();
  return text.str();
}

}  // namespace

Process::Process(const std::vector<std::string>& command, const std::filesystem::path& log,
                 const std::vector<std::string>& environment)
    : pid_(spawn(command, log, log, environment)) {
  if (pid_ < 0) throw std::runtime_error("cannot start " + command.front());
}

Process::~Process() {
  if (!status_) {
    ::kill(pid_, SIGKILL);
    wait(10s);
  }
}

void Process::signal(int number) { ::kill(pid_, number); }

std::optional<int> Process::wait(std::chrono::milliseconds patience) {
  const auto deadline = Clock::now() + patience;
  while (!status_) {
    int status = 0;
    if (::waitpid(pid_, &status, WNOHANG) == pid_)
      status_ = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
    else if (Clock::now() >= deadline)
      return std::nullopt;
    else
      std::this_thread::sleep_for(2ms);
  }
  return status_;
}

std::filesystem::path program_folder() {
  return std::filesystem::read_symlink("/proc/self/exe").parent_path();
}

Finished run_program(const std::vector<std::string>& command, std::chrono::seconds patience) {
  std::string folder = (std::filesystem::temp_directory_path() / "zeropose-run-XXXXXX").string();
  if (!::mkdtemp(folder.data())) throw std::runtime_error("cannot make " + folder);
  const std::filesystem::path out = folder + "/out", err = folder + "/err";
  Finished finished;
  const pid_t pid = spawn(command, out, err, {});
  const auto deadline = Clock::now() + patience;
  int status = 0;
  while (::waitpid(pid, &status, WNOHANG) == 0) {
    if (Clock::now() > deadline) ::kill(pid, SIGKILL);
    std::this_thread::sleep_for(2ms);
  }
  finished.status = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
  finished.out = content(out);
  finished.err = content(err);
  std::filesystem::remove_all(folder);
  return finished;
}

NotifyListener::NotifyListener(const std::filesystem::path& socket)
    : fd_(::socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0)) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  std::strncpy(address.sun_path, socket.c_str(), sizeof address.sun_path - 1);
  if (::bind(fd_, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0)
    throw std::runtime_error("cannot bind " + socket.string());
  thread_ = std::jthread([this](const std::stop_token& stop) { listen(stop); });
}

NotifyListener::~NotifyListener() {
  thread_.request_stop();
  thread_.join();
  ::close(fd_);
}

void NotifyListener::listen(const std::stop_token& stop) {
  while (!stop.stop_requested()) {
    pollfd entry{fd_, POLLIN, 0};
    if (::poll(&entry, 1, 50) <= 0) continue;
    char text[4096];
    const ssize_t size = ::recv(fd_, text, sizeof text, 0);
    std::istringstream message(std::string(text, size > 0 ? static_cast<std::size_t>(size) : 0));
    const std::scoped_lock lock(mutex_);
    for (std::string line; std::getline(message, line);) lines_.push_back(line);
    came_.notify_all();
  }
}

bool NotifyListener::heard(const std::string& line, std::chrono::milliseconds patience) {
  std::unique_lock lock(mutex_);
  return came_.wait_for(lock, patience, [&] {
    while (!lines_.empty()) {
      const bool found = lines_.front() == line;
      lines_.pop_front();
      if (found) return true;
    }
    return false;
  });
}

}  // namespace zeropose
