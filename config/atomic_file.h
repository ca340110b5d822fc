// Replacing a file so that a reader, a crash or a power cut sees the old one or the new one, never a mix.
#pragma once

#include <sys/types.h>

#include <cstddef>
#include <filesystem>
#include <string_view>

namespace zeropose {

// The system calls of a save, one member each: tests put faults in. All return -1 and set errno on failure.
class FileCalls {
 public:
  virtual ~FileCalls() = default;
  virtual int open(const char* path, int flags, unsigned mode);
  virtual ssize_t write(int descriptor, const void* bytes, std::size_t count);
  virtual int fsync(int descriptor);
  virtual int close(int descriptor);
  virtual int link(const char* from, const char* to);
  virtual int rename(const char* from, const char* to);
  virtual int unlink(const char* path);
};

FileCalls& system_file_calls();

// Writes a temporary file in the same directory, fsyncs it, keeps the present file (if any) as
// `path.previous`, renames the temporary file to `path` and fsyncs the directory. Throws std::system_error
// that names the step and the file; the present file is then still the old one, or (only when the last fsync
// failed) the new one, which may not survive a power cut. No failed descriptor is ever used again.
void replace_file(const std::filesystem::path& path, std::string_view bytes,
                  FileCalls& calls = system_file_calls());

std::filesystem::path previous_of(const std::filesystem::path& path);

}  // namespace zeropose
