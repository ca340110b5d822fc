#include "config/atomic_file.h"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <system_error>

namespace zeropose {
namespace {

[[noreturn]] void fail(const std::string& step, const std::filesystem::path& path, int error) {
  throw std::system_error(error, std::generic_category(), path.string() + ": cannot " + step);
}

// An open descriptor; closed at the end whatever happens.
class Descriptor {
 public:
  Descriptor(FileCalls& calls, const std::filesystem::path& path, int flags)
      : calls_(calls), path_(path), number_(calls.open(path.c_str(), flags | O_CLOEXEC, 0644)) {
    if (number_ < 0) fail("open", path_, errno);
  }
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  ~Descriptor() {
    if (number_ >= 0) calls_.close(number_);
  }

  void write(std::string_view bytes) {
    while (!bytes.empty()) {
      const ssize_t written = calls_.write(number_, bytes.data(), bytes.size());
      if (written < 0 && errno == EINTR) continue;
      if (written < 0) fail("write", path_, errno);
      if (written == 0) fail("write", path_, ENOSPC);
      bytes.remove_prefix(static_cast<std::size_t>(written));
    }
  }

  // Never repeated: after a failed fsync the kernel may have dropped the pages and call them clean.
  void sync() {
    if (calls_.fsync(number_) != 0) fail("fsync", path_, errno);
  }

  void close() {
    const int number = number_;
    number_ = -1;
    if (calls_.close(number) != 0) fail("close", path_, errno);
  }

 private:
  FileCalls& calls_;
  std::filesystem::path path_;
  int number_;
};

// Removes the temporary file unless it became the real one.
class TemporaryFile {
 public:
  TemporaryFile(FileCalls& calls, std::filesystem::path path) : calls_(calls), path_(std::move(path)) {}
  TemporaryFile(const TemporaryFile&) = delete;
  TemporaryFile& operator=(const TemporaryFile&) = delete;
  ~TemporaryFile() {
    if (!renamed_) calls_.unlink(path_.c_str());
  }
  void rename_to(const std::filesystem::path& path) {
    if (calls_.rename(path_.c_str(), path.c_str()) != 0) fail("rename to", path, errno);
    renamed_ = true;
  }
  const std::filesystem::path& path() const { return path_; }

 private:
  FileCalls& calls_;
  std::filesystem::path path_;
  bool renamed_ = false;
};

// A second name for the present file, put in place by a rename, so that there is always a previous one.
void keep_previous(const std::filesystem::path& path, FileCalls& calls) {
  TemporaryFile second_name(calls, path.string() + ".previous.tmp");
  calls.unlink(second_name.path().c_str());
  if (calls.link(path.c_str(), second_name.path().c_str()) != 0) {
    if (errno == ENOENT) return;
    fail("keep the previous", path, errno);
  }
  second_name.rename_to(previous_of(path));
  // A rename between two names of one file does nothing: after a crash right here the name would stay.
  calls.unlink(second_name.path().c_str());
}

std::filesystem::path directory_of(const std::filesystem::path& path) {
  return path.has_parent_path() ? path.parent_path() : std::filesystem::path(".");
}

}  // namespace

int FileCalls::open(const char* path, int flags, unsigned mode) { return ::open(path, flags, mode); }
ssize_t FileCalls::write(int descriptor, const void* bytes, std::size_t count) {
  return ::write(descriptor, bytes, count);
}
int FileCalls::fsync(int descriptor) { return ::fsync(descriptor); }
int FileCalls::close(int descriptor) { return ::close(descriptor); }
int FileCalls::link(const char* from, const char* to) { return ::link(from, to); }
int FileCalls::rename(const char* from, const char* to) { return ::rename(from, to); }
int FileCalls::unlink(const char* path) { return ::unlink(path); }

FileCalls& system_file_calls() {
  static FileCalls calls;
  return calls;
}

std::filesystem::path previous_of(const std::filesystem::path& path) { return path.string() + ".previous"; }

void replace_file(const std::filesystem::path& path, std::string_view bytes, FileCalls& calls) {
  TemporaryFile temporary(calls, path.string() + ".tmp");
  {
    Descriptor file(calls, temporary.path(), O_WRONLY | O_CREAT | O_TRUNC | O_NOFOLLOW);
    file.write(bytes);
    file.sync();
    file.close();
  }
  keep_previous(path, calls);
  temporary.rename_to(path);
  Descriptor directory(calls, directory_of(path), O_RDONLY | O_DIRECTORY);
  directory.sync();
}

}  // namespace zeropose
