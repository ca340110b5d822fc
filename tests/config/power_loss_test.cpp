// R13 and R14: saving is interrupted or fails at every step; the file is the old one or the new one.
#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sched.h>
#include <signal.h>
#include <sys/mman.h>
#include <sys/mount.h>
#include <sys/ptrace.h>
#include <sys/wait.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <new>
#include <random>
#include <set>
#include <system_error>

#include "config/records.h"
#include "tests/support/temporary_folder.h"

namespace zeropose {
namespace {

ZeroRecord record_of_frames(int frames) {
  ZeroRecord record;
  record.job = "body";
  record.frames = frames;
  record.time_utc = "2026-01-31T12:34:56Z";
  record.zero.compensation_O_mm.assign(100, Eigen::Vector3d(0.1 * frames, 0.2, 0.3));
  return record;
}

int frames_of(const std::filesystem::path& directory) { return load_zero(directory, "body").value().frames; }

// What a save does, in order, with a fault at one call.
class FaultyCalls : public FileCalls {
 public:
  std::size_t fail_at = 0;  // counted from 1; 0: never
  int error = EIO;
  std::size_t kill_at = 0;  // dies before this call, counted from 1 with unlink; 0: never
  std::size_t calls_made = 0;
  std::vector<std::string> log;
  std::set<int> synced_badly;
  bool touched_after_bad_sync = false;

  int open(const char* path, int flags, unsigned mode) override {
    return fails("open") ? -1 : FileCalls::open(path, flags, mode);
  }
  ssize_t write(int descriptor, const void* bytes, std::size_t count) override {
    touched_after_bad_sync |= synced_badly.contains(descriptor);
    if (fails("write")) return -1;
    // Short writes are the rule here, so that the loop is seen working.
    return FileCalls::write(descriptor, bytes, std::min<std::size_t>(count, 500));
  }
  int fsync(int descriptor) override {
    touched_after_bad_sync |= synced_badly.contains(descriptor);
    if (!fails("fsync")) return FileCalls::fsync(descriptor);
    synced_badly.insert(descriptor);
    return -1;
  }
  int close(int descriptor) override {
    const bool bad = fails("close");
    synced_badly.erase(descriptor);
    FileCalls::close(descriptor);
    return bad ? -1 : 0;
  }
  int link(const char* from, const char* to) override {
    return fails("link") ? -1 : FileCalls::link(from, to);
  }
  int rename(const char* from, const char* to) override {
    return fails("rename") ? -1 : FileCalls::rename(from, to);
  }
  int unlink(const char* path) override {
    count();
    return FileCalls::unlink(path);
  }

 private:
  void count() {
    if (++calls_made == kill_at) kill(getpid(), SIGKILL);
  }
  bool fails(const std::string& call) {
    count();
    log.push_back(call);
    if (log.size() != fail_at) return false;
    errno = error;
    return true;
  }
};

TEST(PowerLoss, StepsComeInTheOrderThatSurvives) {
  const TemporaryFolder directory;
  save_zero(directory.path(), record_of_frames(1));
  FaultyCalls calls;
  save_zero(directory.path(), record_of_frames(2), calls);
  std::vector<std::string> steps;
  for (const std::string& call : calls.log)
    if (steps.empty() || steps.back() != call) steps.push_back(call);
  // File: open, write, fsync, close. Previous: link, rename. Then rename, and the directory: open, fsync,
  // close.
  EXPECT_THAT(steps, testing::ElementsAre("open", "write", "fsync", "close", "link", "rename", "open",
                                          "fsync", "close"));
  EXPECT_EQ(std::count(calls.log.begin(), calls.log.end(), "rename"), 2);
  EXPECT_GT(std::count(calls.log.begin(), calls.log.end(), "write"), 2);
}

TEST(PowerLoss, EveryFailingCallIsReportedAndTheOldFileStays) {
  FaultyCalls counting;
  {
    const TemporaryFolder directory;
    save_zero(directory.path(), record_of_frames(1));
    save_zero(directory.path(), record_of_frames(2), counting);
  }
  const std::size_t steps = counting.log.size();
  ASSERT_GT(steps, 10U);
  for (std::size_t at = 1; at < steps; ++at) {
    const TemporaryFolder directory;
    save_zero(directory.path(), record_of_frames(1));
    FaultyCalls calls;
    calls.fail_at = at;
    calls.error = at % 2 == 0 ? EIO : ENOSPC;
    EXPECT_THROW(save_zero(directory.path(), record_of_frames(2), calls), std::system_error)
        << calls.log.back();
    EXPECT_FALSE(calls.touched_after_bad_sync);
    // The directory is opened and synced after the rename: then the new file is there, and the failure is
    // said.
    EXPECT_EQ(frames_of(directory.path()), at >= steps - 2 ? 2 : 1) << "step " << at;
    save_zero(directory.path(), record_of_frames(3));
    EXPECT_EQ(frames_of(directory.path()), 3);
  }
}

TEST(PowerLoss, MessageNamesStepFileAndCause) {
  const TemporaryFolder directory;
  try {
    save_zero(directory.path() / "missing", record_of_frames(1));
    FAIL();
  } catch (const std::system_error& error) {
    EXPECT_THAT(error.what(),
                testing::HasSubstr("zero-body.json.tmp: cannot open: No such file or directory"));
  }
}

// Dying before call k is dying after call k - 1: this covers every state that the directory goes through.
TEST(PowerLoss, KilledBetweenAnyTwoCallsTheFileIsOldOrNew) {
  FaultyCalls counting;
  {
    const TemporaryFolder directory;
    save_zero(directory.path(), record_of_frames(1));
    save_zero(directory.path(), record_of_frames(2), counting);
  }
  bool seen_new = false;
  for (std::size_t at = 1; at <= counting.calls_made; ++at) {
    const TemporaryFolder directory;
    save_zero(directory.path(), record_of_frames(1));
    const pid_t child = fork();
    if (child == 0) {
      FaultyCalls calls;
      calls.kill_at = at;
      save_zero(directory.path(), record_of_frames(2), calls);
      _exit(0);
    }
    int status = 0;
    waitpid(child, &status, 0);
    ASSERT_TRUE(WIFSIGNALED(status)) << "call " << at;
    const int frames = frames_of(directory.path());
    EXPECT_TRUE(frames == 2 || (frames == 1 && !seen_new)) << "call " << at;
    seen_new |= frames == 2;
    save_zero(directory.path(), record_of_frames(3));
    EXPECT_EQ(frames_of(directory.path()), 3);
  }
  EXPECT_TRUE(seen_new);
}

// A child that saves and is killed after a number of system call stops; true when it ended by itself before.
bool save_killed_after(int stops, const std::filesystem::path& directory) {
  const pid_t child = fork();
  if (child == 0) {
    ptrace(PTRACE_TRACEME, 0, nullptr, nullptr);
    raise(SIGSTOP);
    save_zero(directory, record_of_frames(2));
    _exit(0);
  }
  int status = 0;
  waitpid(child, &status, 0);
  for (int stop = 0; stop < stops && WIFSTOPPED(status); ++stop) {
    ptrace(PTRACE_SYSCALL, child, nullptr, nullptr);
    waitpid(child, &status, 0);
  }
  if (!WIFSTOPPED(status)) return true;
  kill(child, SIGKILL);
  waitpid(child, &status, 0);
  return false;
}

bool tracing_allowed() {
  const pid_t child = fork();
  if (child == 0) _exit(ptrace(PTRACE_TRACEME, 0, nullptr, nullptr) == 0 ? 0 : 1);
  int status = 0;
  waitpid(child, &status, 0);
  return WIFEXITED(status) && WEXITSTATUS(status) == 0;
}

// The same by the kernel, at every system call of the whole child. Which call the n-th one is may differ
// between runs (allocations); the test above is the exact one.
TEST(PowerLoss, KilledAtEverySystemCallTheFileIsOldOrNew) {
  if (!tracing_allowed()) GTEST_SKIP() << "ptrace is not allowed here";
  bool ended = false, seen_old = false, seen_new = false;
  int stops = 0;
  for (; !ended; ++stops) {
    ASSERT_LT(stops, 5000);
    const TemporaryFolder directory;
    save_zero(directory.path(), record_of_frames(1));
    const std::string old_text = text_of_file(zero_path(directory.path(), "body"));
    ended = save_killed_after(stops, directory.path());
    const int frames = frames_of(directory.path());
    EXPECT_TRUE(frames == 1 || frames == 2);
    if (frames == 1) {
      EXPECT_EQ(text_of_file(zero_path(directory.path(), "body")), old_text);
    }
    seen_old |= frames == 1;
    seen_new |= frames == 2;
    // What was left behind is in nobody's way.
    save_zero(directory.path(), record_of_frames(3));
    EXPECT_EQ(frames_of(directory.path()), 3);
  }
  EXPECT_TRUE(seen_old && seen_new);
  EXPECT_GT(stops, 20);
}

// What a saving process has reported as safely stored, seen by its parent.
class SharedCount {
 public:
  SharedCount()
      : count_(new (mmap(nullptr, sizeof(std::atomic<int>), PROT_READ | PROT_WRITE,
                         MAP_SHARED | MAP_ANONYMOUS, -1, 0)) std::atomic<int>(0)) {}
  ~SharedCount() { munmap(count_, sizeof(std::atomic<int>)); }
  SharedCount(const SharedCount&) = delete;
  SharedCount& operator=(const SharedCount&) = delete;
  std::atomic<int>& operator*() { return *count_; }

 private:
  std::atomic<int>* count_;
};

// At any time while zeros are saved one after the other: what is there is the one that was reported last, or
// the one after it.
void expect_no_zero_is_lost(int kills) {
  const TemporaryFolder directory;
  std::mt19937 generator(5);
  SharedCount saved;
  save_zero(directory.path(), record_of_frames(*saved = 1));
  for (int kill_number = 0; kill_number < kills; ++kill_number) {
    const int before = *saved;
    const pid_t child = fork();
    if (child == 0) {
      for (int frames = before + 1;; ++frames) {
        save_zero(directory.path(), record_of_frames(frames));
        *saved = frames;
      }
    }
    // Not before it saves, else a busy machine would only show processes that have not begun.
    while (*saved == before && waitpid(child, nullptr, WNOHANG) == 0) usleep(100);
    usleep(std::uniform_int_distribution<useconds_t>(0, 20'000)(generator));
    kill(child, SIGKILL);
    waitpid(child, nullptr, 0);
    const int frames = frames_of(directory.path());
    ASSERT_GT(*saved, before);
    ASSERT_TRUE(frames == *saved || frames == *saved + 1)
        << frames << " is there, " << *saved << " was reported";
    *saved = frames;
  }
}

TEST(PowerLoss, KilledAtAnyTimeTwentyTimes) { expect_no_zero_is_lost(20); }
TEST(PowerLossLong, KilledAtAnyTimeAHundredTimes) { expect_no_zero_is_lost(100); }

constexpr int cannot_mount = 77;

// In a child with its own mounts: a file system of 64 KB, full to the brim.
int save_on_a_full_disk(const std::filesystem::path& directory) {
  if (unshare(CLONE_NEWNS) != 0) return cannot_mount;
  if (mount(nullptr, "/", nullptr, MS_REC | MS_PRIVATE, nullptr) != 0) return cannot_mount;
  if (mount("tmpfs", directory.c_str(), "tmpfs", 0, "size=64k") != 0) return cannot_mount;
  save_zero(directory, record_of_frames(1));
  std::string filler(4096, 'x');
  const int full = open((directory / "filler").c_str(), O_WRONLY | O_CREAT, 0600);
  while (write(full, filler.data(), filler.size()) > 0) {
  }
  close(full);
  try {
    save_zero(directory, record_of_frames(2));
    return 1;
  } catch (const std::system_error& error) {
    if (error.code() != std::errc::no_space_on_device) return 2;
  }
  if (frames_of(directory) != 1) return 3;
  if (std::filesystem::exists(directory / "zero-body.json.tmp")) return 4;
  std::filesystem::remove(directory / "filler");
  save_zero(directory, record_of_frames(2));
  return frames_of(directory) == 2 ? 0 : 5;
}

TEST(PowerLoss, FullDiskIsReportedAndTheOldFileStays) {
  const TemporaryFolder directory;
  const pid_t child = fork();
  if (child == 0) {
    int result = 9;
    try {
      result = save_on_a_full_disk(directory.path());
    } catch (const std::exception&) {
      result = 8;
    }
    _exit(result);
  }
  int status = 0;
  waitpid(child, &status, 0);
  ASSERT_TRUE(WIFEXITED(status));
  if (WEXITSTATUS(status) == cannot_mount) GTEST_SKIP() << "may not mount a tmpfs here (needs root)";
  EXPECT_EQ(WEXITSTATUS(status), 0);
}

}  // namespace
}  // namespace zeropose
