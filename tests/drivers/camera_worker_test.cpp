#include "drivers/camera_worker.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <optional>

#include "tests/drivers/numbered_cameras.h"

namespace zeropose {
namespace {

using namespace std::chrono_literals;
using std::chrono::steady_clock;
using ::testing::AnyOf;
using ::testing::HasSubstr;

TimePoint in(std::chrono::milliseconds time) { return steady_clock::now() + time; }

// Waits until the condition holds; false: not within the time.
template <class Condition>
bool becomes(Condition condition, std::chrono::milliseconds within) {
  for (const TimePoint end = in(within); steady_clock::now() < end; std::this_thread::sleep_for(5ms))
    if (condition()) return true;
  return false;
}

bool becomes_state(const CameraWorker& worker, CameraState state, std::chrono::milliseconds within) {
  return becomes([&] { return worker.state() == state; }, within);
}

class FourCameras : public ::testing::Test {
 protected:
  void open(CameraWorkerOptions options = {}) {
    for (std::size_t i = 0; i < 4; ++i)
      workers_.push_back(std::make_unique<CameraWorker>(simulated_.options(i), open_camera, options));
    for (const auto& worker : workers_) ASSERT_TRUE(becomes_state(*worker, CameraState::alive, 5s));
  }
  std::vector<GrabResult> grab_all(std::chrono::milliseconds within) {
    const TimePoint deadline = in(within);
    std::vector<CameraWorker::Pending> pending;
    for (const auto& worker : workers_) pending.push_back(worker->request(deadline));
    std::vector<GrabResult> results;
    for (auto& one : pending) results.push_back(one.wait());
    return results;
  }
  void TearDown() override {
    for (const auto& worker : workers_) worker->request_stop();
  }

  NumberedCameras simulated_{4};
  std::vector<std::unique_ptr<CameraWorker>> workers_;
};

TEST_F(FourCameras, FiftyTimesInParallel) {
  open();
  for (int round = 0; round < 50; ++round) {
    const std::uint64_t scene = simulated_.new_scene();
    const auto results = grab_all(3s);
    for (std::size_t i = 0; i < 4; ++i) {
      ASSERT_EQ(results[i].status, GrabStatus::ok) << results[i].reason;
      ASSERT_EQ(number_of(results[i].frame).scene, scene);
      ASSERT_EQ(number_of(results[i].frame).camera, i);
      ASSERT_TRUE(all_of_one_scene(results[i].frame));
      ASSERT_EQ(results[i].frame.camera, simulated_.options(i).name);
    }
  }
  for (const auto& worker : workers_) EXPECT_EQ(worker->statistics().renewals, 0u);
}

// Deadlines around the time that a frame needs: late ones are dropped, none is ever of an earlier scene.
TEST_F(FourCameras, LateFramesAreDropped) {
  open({.timeouts_until_reopened = 1000});
  int ok = 0, late = 0;
  for (int round = 0; round < 40; ++round) {
    const std::uint64_t scene = simulated_.new_scene();
    const int step = round % 20;  // the longest, a second, is enough on a busy machine too
    for (const GrabResult& result : grab_all(std::chrono::milliseconds(4 + 3 * step * step))) {
      ++(result.status == GrabStatus::ok ? ok : late);
      if (result.status == GrabStatus::ok)
        ASSERT_EQ(number_of(result.frame).scene, scene);
      else  // damaged: the library now and then gives up a frame of a stream that began anew
        ASSERT_THAT(result.status, AnyOf(GrabStatus::timeout, GrabStatus::damaged)) << result.reason;
    }
  }
  EXPECT_GT(ok, 0);
  EXPECT_GT(late, 0);
}

TEST_F(FourCameras, OneKilledInMidGrabAndBack) {
  open();
  const TimePoint deadline = in(1s);
  std::vector<CameraWorker::Pending> pending;
  for (const auto& worker : workers_) pending.push_back(worker->request(deadline));
  simulated_.server().stop_camera(2);
  std::vector<GrabResult> results;
  for (auto& one : pending) results.push_back(one.wait());
  EXPECT_LT(steady_clock::now(), deadline + 1s);
  for (const std::size_t i : {0u, 1u, 3u}) EXPECT_EQ(results[i].status, GrabStatus::ok) << results[i].reason;

  // The others go on as if nothing had happened; the dead one is known as missing soon.
  EXPECT_TRUE(becomes_state(*workers_[2], CameraState::missing, 3s));
  results = grab_all(2s);
  EXPECT_EQ(results[2].status, GrabStatus::missing);
  EXPECT_THAT(results[2].reason, HasSubstr("camera3 (127.0.0.13)"));
  for (const std::size_t i : {0u, 1u, 3u}) EXPECT_EQ(results[i].status, GrabStatus::ok) << results[i].reason;

  simulated_.server().start_camera(2);
  EXPECT_TRUE(becomes_state(*workers_[2], CameraState::alive, 10s));
  const std::uint64_t scene = simulated_.new_scene();
  for (const GrabResult& result : grab_all(3s)) {
    ASSERT_EQ(result.status, GrabStatus::ok) << result.reason;
    EXPECT_EQ(number_of(result.frame).scene, scene);
  }
}

TEST_F(FourCameras, IdleCameraThatGoesIsNoticed) {
  open();
  simulated_.server().stop_camera(0);
  EXPECT_TRUE(becomes_state(*workers_[0], CameraState::missing, 3s));
  const GrabResult result = workers_[0]->request(in(10s)).wait();  // at once, not at the deadline
  EXPECT_EQ(result.status, GrabStatus::missing);
  EXPECT_FALSE(result.reason.empty());
  simulated_.server().start_camera(0);  // a lost camera ends slowly
}

TEST_F(FourCameras, LostPacketsAreDamaged) {
  open();
  simulated_.server().lose_packets(1, 0.1);
  bool damaged = false;
  for (int i = 0; i < 20 && !damaged; ++i) {
    const auto results = grab_all(1s);
    EXPECT_EQ(results[0].status, GrabStatus::ok) << results[0].reason;
    damaged = results[1].status == GrabStatus::damaged;
  }
  EXPECT_TRUE(damaged);
  simulated_.server().lose_packets(1, 0);
  EXPECT_TRUE(becomes([&] { return workers_[1]->request(in(1s)).wait().status == GrabStatus::ok; }, 5s));
  EXPECT_GE(workers_[1]->statistics().damaged, 1u);
}

TEST(CameraWorker, MissingAtStartIsUsedOnceItIsThere) {
  std::optional<NumberedCameras> simulated;  // outlives the worker: a lost camera ends slowly
  CameraWorker worker(NumberedCameras::options_for(1)[0]);
  EXPECT_TRUE(becomes_state(worker, CameraState::missing, 5s));
  EXPECT_EQ(worker.request(in(100ms)).wait().status, GrabStatus::missing);
  simulated.emplace(1);
  EXPECT_TRUE(becomes_state(worker, CameraState::alive, 10s));
  EXPECT_EQ(worker.request(in(3s)).wait().status, GrabStatus::ok);
}

TEST(CameraWorker, WrongSizeIsNamedAsSuch) {
  NumberedCameras simulated(1, 640, 480);
  CameraOptions options = simulated.options(0);
  options.width_px = 768;
  CameraWorker worker(options);
  ASSERT_TRUE(becomes_state(worker, CameraState::missing, 5s));
  const GrabResult result = worker.request(in(1s)).wait();
  EXPECT_EQ(result.status, GrabStatus::wrong_size);
  EXPECT_THAT(result.reason, HasSubstr("640x480"));
}

TEST(CameraWorker, FrameOfWrongSize) {
  NumberedCameras simulated(1);
  CameraWorker worker(simulated.options(0));
  ASSERT_TRUE(becomes_state(worker, CameraState::alive, 5s));
  simulated.server().send_narrower(0, 700);
  EXPECT_EQ(worker.request(in(1s)).wait().status, GrabStatus::wrong_size);
}

// A camera without a network: what it does is decided by the test.
struct Script {
  std::atomic<int> opened = 0;
  std::atomic<int> block_ms = 0;  // in trigger(), as a lost device does
  std::atomic<bool> deliver = true, alive = true;
};

class ScriptedCamera final : public Camera {
 public:
  explicit ScriptedCamera(Script& script) : script_(script) { ++script.opened; }
  void start() override {}
  void trigger() override { std::this_thread::sleep_for(std::chrono::milliseconds(script_.block_ms)); }
  std::optional<Frame> grab(TimePoint deadline) override {
    Frame frame;
    frame.sequence = ++sequence_;
    if (script_.deliver) return frame;
    std::this_thread::sleep_until(deadline);
    return std::nullopt;
  }
  void stop() noexcept override {}
  void check() override {
    if (!script_.alive) throw DeviceError("camera gone");
  }

 private:
  Script& script_;
  std::uint64_t sequence_ = 0;
};

class ScriptedWorker : public ::testing::Test {
 protected:
  void SetUp() override { ASSERT_TRUE(becomes_state(worker_, CameraState::alive, 5s)); }

  Script script_;
  CameraWorker worker_{CameraOptions{.name = "camera1", .gige = {.address = "test"}},
                       [this](const CameraOptions&) { return std::make_unique<ScriptedCamera>(script_); },
                       CameraWorkerOptions{.check_period = 50ms, .overdue = 400ms}};
};

// The caller leaves at the deadline although the library blocks; the late frame answers nobody.
TEST_F(ScriptedWorker, BlockingLibraryDoesNotHoldTheCaller) {
  script_.block_ms = 1500;
  const TimePoint begin = steady_clock::now();
  EXPECT_EQ(worker_.request(in(300ms)).wait().status, GrabStatus::timeout);
  EXPECT_LT(steady_clock::now() - begin, 1000ms);
  script_.block_ms = 0;
  EXPECT_TRUE(becomes_state(worker_, CameraState::missing, 1s));  // while it blocks
  EXPECT_EQ(worker_.request(in(5s)).wait().status, GrabStatus::missing);
  EXPECT_TRUE(becomes_state(worker_, CameraState::alive, 5s));
  const GrabResult result = worker_.request(in(5s)).wait();
  ASSERT_EQ(result.status, GrabStatus::ok);
  EXPECT_EQ(result.frame.sequence, 2u);  // the first came late and was dropped
}

// On a busy machine a request's time may be over before the camera was asked: that is no time-out of the
// camera.
TEST_F(ScriptedWorker, TimeoutsInARowOpenItAnew) {
  script_.deliver = false;
  int requests = 0;
  const auto opened_anew = [&] {
    EXPECT_NE(worker_.request(in(20ms)).wait().status, GrabStatus::ok);
    ++requests;
    return script_.opened == 2;
  };
  EXPECT_TRUE(becomes(opened_anew, 10s));
  EXPECT_GE(requests, 3);
  script_.deliver = true;
  EXPECT_TRUE(becomes_state(worker_, CameraState::alive, 5s));
  EXPECT_EQ(worker_.request(in(5s)).wait().status, GrabStatus::ok);
}

TEST_F(ScriptedWorker, NoSignOfLifeOpensItAnew) {
  script_.alive = false;
  EXPECT_TRUE(becomes([&] { return script_.opened >= 2; }, 5s));
  script_.alive = true;
  EXPECT_TRUE(becomes_state(worker_, CameraState::alive, 5s));
}

TEST_F(ScriptedWorker, RequestsAreServedInOrder) {
  const TimePoint deadline = in(5s);
  auto first = worker_.request(deadline), second = worker_.request(deadline);
  EXPECT_EQ(second.wait().frame.sequence, 2u);
  EXPECT_EQ(first.wait().frame.sequence, 1u);
}

}  // namespace
}  // namespace zeropose
