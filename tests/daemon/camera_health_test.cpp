// What the pictures of each camera say about lens and light, from measurement to measurement (spec 50 M6.1).
#include "daemon/camera_health.h"

#include <gmock/gmock.h>
#include <spdlog/sinks/ostream_sink.h>
#include <spdlog/spdlog.h>

#include <sstream>

namespace zeropose {
namespace {

using testing::HasSubstr;

// Two cameras with one mark each; the log goes into a text.
class Health : public testing::Test {
 protected:
  Health() {
    for (const char* name : {"left", "right"}) cell.cameras.emplace_back().name = name;
    job.marks.resize(2);
    job.views = {{0, 0}, {1, 1}};
    spdlog::set_default_logger(
        std::make_shared<spdlog::logger>("test", std::make_shared<spdlog::sinks::ostream_sink_mt>(log)));
  }
  ~Health() override { spdlog::set_default_logger(before); }

  // A measurement from pictures of these cameras, with the blur of the marks that were found.
  void measured(const std::vector<std::size_t>& cameras, double noise_grey,
                std::vector<std::optional<double>> blur_px) {
    std::vector<CameraImage> images;
    Measurement measurement;
    measurement.findings.resize(2);
    for (std::size_t i = 0; i < cameras.size(); ++i) {
      images.push_back({cameras[i], {}});
      measurement.health.push_back({noise_grey, 0, 0, 100, {}});
      if (!blur_px[i]) continue;
      measurement.findings[cameras[i]].status = MarkStatus::found;
      measurement.findings[cameras[i]].blur_px = *blur_px[i];
    }
    follow_health(health, images, measurement, job, cell);
  }

  Cell cell;
  Job job;
  std::vector<CameraHealth> health = std::vector<CameraHealth>(2);
  std::ostringstream log;

 private:
  const std::shared_ptr<spdlog::logger> before = spdlog::default_logger();
};

TEST_F(Health, IsThatOfTheCameraThatTookThePicture) {
  measured({1}, 2.5, {0.7});
  EXPECT_FALSE(health[0].seen);
  EXPECT_EQ(health[0].noise.count, 0);
  EXPECT_TRUE(health[1].seen);
  EXPECT_EQ(health[1].picture.noise_grey, 2.5);
  EXPECT_EQ(health[1].focus.mean, 0.7);
}

TEST_F(Health, WithoutAMarkHasNoFocusButNoise) {
  measured({0, 1}, 2, {std::nullopt, 0.7});
  EXPECT_EQ(health[0].focus.count, 0);
  EXPECT_EQ(health[0].noise.count, 1);
  EXPECT_EQ(health[1].focus.count, 1);
}

TEST_F(Health, AFocusThatChangesIsLoggedOnceAndOnceWhenItIsBack) {
  for (int i = 0; i < 10; ++i) measured({0, 1}, 2, {0.7, 0.7});
  EXPECT_EQ(log.str(), "");
  for (int i = 0; i < 40; ++i) measured({0, 1}, 2, {1.4, 0.7});
  EXPECT_TRUE(health[0].focus.changed);
  EXPECT_FALSE(health[1].focus.changed);
  const std::string changed = log.str();
  EXPECT_THAT(changed, HasSubstr("left: the focus (blur of its marks, px) has changed"));
  EXPECT_EQ(std::ranges::count(changed, '\n'), 1) << changed;
  for (int i = 0; i < 60; ++i) measured({0, 1}, 2, {0.7, 0.7});
  EXPECT_FALSE(health[0].focus.changed);
  EXPECT_THAT(log.str(), HasSubstr("left: the focus (blur of its marks, px) is as before"));
  EXPECT_EQ(std::ranges::count(log.str(), '\n'), 2) << log.str();
}

TEST_F(Health, NoiseThatGrowsIsLoggedForEveryCameraThatShowsIt) {
  for (int i = 0; i < 10; ++i) measured({0, 1}, 2, {0.7, 0.7});
  for (int i = 0; i < 40; ++i) measured({0, 1}, 4, {0.7, 0.7});
  EXPECT_THAT(log.str(), HasSubstr("left: the noise of its pictures (grey levels) has changed"));
  EXPECT_THAT(log.str(), HasSubstr("right: the noise of its pictures (grey levels) has changed"));
}

}  // namespace
}  // namespace zeropose
