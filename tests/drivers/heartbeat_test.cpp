// The library's heartbeat thread finds that a device is lost at the worst moment: while the device is
// destroyed. This program's g_signal_emit and g_mutex_unlock come before GLib's, so that the thread can be
// held there.
#include <arv.h>
#include <dlfcn.h>
#include <gtest/gtest.h>

#include <atomic>
#include <condition_variable>
#include <mutex>
#include <thread>
#include <utility>

#include "drivers/gige_device.h"
#include "tests/drivers/numbered_cameras.h"

namespace zeropose {
namespace {

using namespace std::chrono_literals;

constexpr auto patience = 10s;  // the heartbeat comes once a second, and asks anew after 0.5 s
constexpr int none_held = -1;

// What stands in the way of an emission of "control-lost".
class Bar {
 public:
  struct Emission {
    bool begun = false, ended = false, handlers = false;
  };

  // The next emission is held behind GLib's look at the handlers: behind its first release of a mutex.
  void close() {
    const std::lock_guard lock(mutex_);
    closed_ = true;
  }
  void open() {
    const std::lock_guard lock(mutex_);
    closed_ = false;
    changed_.notify_all();
  }
  bool held(std::chrono::seconds within = patience) {
    std::unique_lock lock(mutex_);
    return changed_.wait_for(lock, within, [this] { return held_; });
  }
  Emission ended(std::chrono::seconds within = patience) {
    std::unique_lock lock(mutex_);
    changed_.wait_for(lock, within, [this] { return emission_.ended; });
    return emission_;
  }
  // Of the device whose emission is held.
  int references() {
    const std::lock_guard lock(mutex_);
    return held_ ? g_atomic_int_get(reinterpret_cast<int*>(&device_->ref_count)) : none_held;
  }

  // Called by the heartbeat thread.
  void begin(GObject* device, bool handlers) {
    const std::lock_guard lock(mutex_);
    device_ = device;
    emission_ = {true, false, handlers};
    changed_.notify_all();
  }
  void pass() {
    std::unique_lock lock(mutex_);
    held_ = closed_;
    changed_.notify_all();
    changed_.wait(lock, [this] { return !closed_; });
    held_ = false;
  }
  void end() {
    const std::lock_guard lock(mutex_);
    emission_.ended = true;
    changed_.notify_all();
  }

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
  bool closed_ = false, held_ = false;
  GObject* device_ = nullptr;
  Emission emission_;
};

std::atomic<Bar*> bar = nullptr;  // of the test under way
thread_local bool before_the_bar = false;

// One camera and the device that controls it; switched off and on, the camera no longer knows us.
class Heartbeat : public ::testing::Test {
 protected:
  Heartbeat() { bar = &bar_; }
  ~Heartbeat() override {
    bar_.open();
    device_.reset();  // its heartbeat thread has ended
    bar = nullptr;
  }

  void switch_off_and_on() {
    simulated_.server().stop_camera(0);
    simulated_.server().start_camera(0);
  }

  template <class Condition>
  static bool becomes(Condition condition) {
    for (const auto end = std::chrono::steady_clock::now() + patience; std::chrono::steady_clock::now() < end;
         std::this_thread::sleep_for(1ms))
      if (condition()) return true;
    return false;
  }

  Bar bar_;
  NumberedCameras simulated_{1};
  std::unique_ptr<GigeDevice> device_ = std::make_unique<GigeDevice>(simulated_.options(0));
};

// A handler would make GLib take a reference to a device that is perhaps being finalized.
TEST_F(Heartbeat, FindsTheLossAndNothingIsConnectedToItsSignal) {
  EXPECT_FALSE(device_->lost());
  switch_off_and_on();
  EXPECT_TRUE(becomes([this] { return device_->lost(); }));
  const Bar::Emission emission = bar_.ended();
  EXPECT_TRUE(emission.ended);
  EXPECT_FALSE(emission.handlers);
}

TEST_F(Heartbeat, FindsTheLossWhileTheDeviceIsDestroyed) {
  bar_.close();
  switch_off_and_on();
  ASSERT_TRUE(bar_.held());
  std::jthread destroyer([this] { device_.reset(); });
  EXPECT_TRUE(
      becomes([this] { return bar_.references() == 0; }));  // it is finalized, and waits for the thread
  bar_.open();
  destroyer.join();  // a wrong emission ends the program here
  EXPECT_TRUE(bar_.ended().ended);
}

}  // namespace
}  // namespace zeropose

extern "C" {

void g_mutex_unlock(GMutex* mutex) {
  static const auto real = reinterpret_cast<void (*)(GMutex*)>(::dlsym(RTLD_NEXT, "g_mutex_unlock"));
  real(mutex);
  if (std::exchange(zeropose::before_the_bar, false)) zeropose::bar.load()->pass();
}

void g_signal_emit(gpointer instance, guint signal, GQuark detail, ...) {
  static const guint control_lost = g_signal_lookup("control-lost", ARV_TYPE_DEVICE);
  const bool watched = signal == control_lost && zeropose::bar != nullptr;
  if (watched) {
    const bool handlers = g_signal_has_handler_pending(instance, signal, detail, TRUE) != FALSE;
    zeropose::bar.load()->begin(static_cast<GObject*>(instance), handlers);
    zeropose::before_the_bar = true;
  }
  va_list arguments;
  va_start(arguments, detail);
  g_signal_emit_valist(instance, signal, detail, arguments);
  va_end(arguments);
  if (watched) zeropose::bar.load()->end();
}
}
