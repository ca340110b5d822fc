// Four cameras that are switched off at random moments of a grab and on again, a hundred times (spec 85 R5).
#include <gtest/gtest.h>

#include <random>

#include "drivers/camera_worker.h"
#include "tests/drivers/numbered_cameras.h"

namespace zeropose {
namespace {

using namespace std::chrono_literals;
using std::chrono::milliseconds;
using std::chrono::steady_clock;

constexpr int cycles_per_camera = 25;
constexpr auto deadline = 475ms;
constexpr auto slack = 50ms;       // of an answer after its deadline
constexpr auto return_time = 10s;  // after the camera is there again

class PowerCycles {
 public:
  PowerCycles(NumberedCameras& simulated, std::size_t camera)
      : simulated_(simulated), camera_(camera), generator_(camera), worker_(simulated.options(camera)) {}

  // False: the camera did not come back in time.
  bool run() {
    for (int i = 0; i < cycles_per_camera; ++i) {
      if (!comes_back()) return false;
      std::this_thread::sleep_for(random_up_to(500ms));  // anywhere within the heartbeat's period
      std::jthread killer([this, after = random_up_to(10ms)] {
        std::this_thread::sleep_for(after);
        simulated_.server().stop_camera(camera_);
      });
      grab();
      killer.join();
      if (generator_() % 2 == 0) grab();
      std::this_thread::sleep_for(random_up_to(600ms));
      simulated_.server().start_camera(camera_);
      for (int k = 0; k < 3; ++k) grab();
    }
    return comes_back() && grab();
  }

  int late() const { return late_; }
  int wrong() const { return wrong_; }
  int good() const { return good_; }

 private:
  bool comes_back() const {
    for (const TimePoint end = steady_clock::now() + return_time; steady_clock::now() < end;
         std::this_thread::sleep_for(2ms))
      if (worker_.state() == CameraState::alive) return true;
    return false;
  }

  bool grab() {
    const TimePoint until = steady_clock::now() + deadline;
    const GrabResult result = worker_.request(until).wait();
    if (steady_clock::now() > until + slack) ++late_;
    if (result.status != GrabStatus::ok) return false;
    ++(all_of_one_scene(result.frame) ? good_ : wrong_);
    return true;
  }

  milliseconds random_up_to(milliseconds most) {
    return milliseconds(std::uniform_int_distribution<std::int64_t>(0, most.count())(generator_));
  }

  NumberedCameras& simulated_;
  const std::size_t camera_;
  std::mt19937_64 generator_;
  int late_ = 0, wrong_ = 0, good_ = 0;
  CameraWorker worker_;
};

TEST(PowerCycles, AHundredTimesEveryAnswerInTimeAndEveryCameraBack) {
  NumberedCameras simulated(4);
  std::vector<std::jthread> threads;
  for (std::size_t camera = 0; camera < 4; ++camera)
    threads.emplace_back([&simulated, camera] {
      PowerCycles cycles(simulated, camera);
      EXPECT_TRUE(cycles.run()) << simulated.options(camera).name;
      EXPECT_EQ(cycles.late(), 0) << simulated.options(camera).name;
      EXPECT_EQ(cycles.wrong(), 0) << simulated.options(camera).name;
      EXPECT_GE(cycles.good(), 1) << simulated.options(camera).name;
    });
}

}  // namespace
}  // namespace zeropose
