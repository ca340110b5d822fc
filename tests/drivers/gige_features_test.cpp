// Features by their standard names, on a camera that has them: the library's fake with our description.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <bit>

#include "drivers/gige_camera.h"
#include "tests/drivers/gige_test.h"
#include "tests/drivers/numbered_cameras.h"
#include "tests/drivers/rich_camera.h"

namespace zeropose {
namespace {

using namespace std::chrono_literals;
using ::testing::HasSubstr;

struct FormatCase {
  PixelFormat format;
  int white, bits;
};

// The grey levels of 0..255 from which the simulated camera made a deep frame; they must fit exactly.
Frame shallow(const Frame& deep, int bits) {
  std::vector<std::uint8_t> levels;
  for (int v = 0; v < deep.height_px; ++v)
    for (int u = 0; u < deep.width_px; ++u) {
      std::uint16_t grey = 0;
      std::memcpy(&grey, deep.row(v).data() + 2 * u, sizeof grey);
      levels.push_back(static_cast<std::uint8_t>(grey >> (bits - 8)));
      if (grey != levels.back() * 257 >> (16 - bits)) ADD_FAILURE() << u << "," << v << ": " << grey;
    }
  Frame frame = deep;
  frame.white = 255;
  frame.stride_bytes = deep.width_px;
  frame.pixels = own_pixels(std::move(levels));
  return frame;
}

class RichCamera : public ::testing::Test {
 protected:
  std::uint32_t reg(std::uint32_t address) { return simulated_.server().read_register(0, address); }
  float real(std::uint32_t address) { return std::bit_cast<float>(reg(address)); }
  void write(std::uint32_t address, std::uint32_t value) {
    simulated_.server().write_register(0, address, value);
  }
  void write(std::uint32_t address, float value) { write(address, std::bit_cast<std::uint32_t>(value)); }

  RichDescription description_;
  NumberedCameras simulated_{1, 320, 240, description_.path()};
  CameraOptions options_ = simulated_.options(0);
};

TEST_F(RichCamera, EveryPixelFormat) {
  for (const auto& [format, white, bits] : {FormatCase{PixelFormat::mono10, 1023, 10},
                                            {PixelFormat::mono12, 4095, 12},
                                            {PixelFormat::mono16, 65535, 16},
                                            {PixelFormat::mono10_packed, 1023, 10},
                                            {PixelFormat::mono12_packed, 4095, 12}}) {
    options_.format = format;
    GigeCamera camera(options_);
    camera.start();
    for (int i = 0; i < 3; ++i) {
      const std::uint64_t scene = simulated_.new_scene();
      const auto frame = triggered_frame(camera);
      ASSERT_TRUE(frame) << white;
      EXPECT_EQ(frame->white, white);
      EXPECT_EQ(frame->stride_bytes, 640);
      const Frame grey = shallow(*frame, bits);
      EXPECT_EQ(number_of(grey).scene, scene) << white;
      EXPECT_TRUE(all_of_one_scene(grey)) << white;
    }
  }
}

TEST_F(RichCamera, FormatThatChangesBehindOurBack) {
  GigeCamera camera(options_);
  camera.start();
  write(rich::pixel_format, std::uint32_t{0x01080002});  // Mono8s, of the same size
  const auto [fault, text] = failure([&] { (void)triggered_frame(camera); });
  EXPECT_EQ(fault, DeviceFault::wrong_size);
  EXPECT_THAT(text,
              HasSubstr("320x240 (76800 bytes of pixel format 0x01080002) came, expected 320x240 Mono8"));
}

TEST_F(RichCamera, RegionOfTheSensor) {
  options_.width_px = 200;
  options_.height_px = 100;
  options_.x_px = 60;
  options_.y_px = 40;
  const GigeCamera camera(options_);
  EXPECT_EQ(reg(rich::offset_x), 60u);
  EXPECT_EQ(reg(rich::offset_y), 40u);
  EXPECT_EQ(reg(rich::width), 200u);
  EXPECT_EQ(reg(rich::height), 100u);
}

TEST_F(RichCamera, RegionBeyondTheSensor) {
  options_.x_px = 1;
  const auto [fault, text] = failure([&] { const GigeCamera camera(options_); });
  EXPECT_EQ(fault, DeviceFault::wrong_size);
  EXPECT_THAT(text, HasSubstr("sensor has 320x240, the cell file wants 320x240 at 1,0"));
}

TEST_F(RichCamera, LightIsSetAndNothingRegulatesItself) {
  write(rich::exposure_auto, std::uint32_t{2});
  write(rich::gain_auto, std::uint32_t{2});
  options_.exposure_us = 2500;
  options_.gain = 4;
  options_.black_level = 1.5;
  options_.gamma = 0.5;
  const GigeCamera camera(options_);
  EXPECT_EQ(reg(rich::exposure_us), 2500u);
  EXPECT_EQ(reg(rich::gain), 4u);
  EXPECT_EQ(reg(rich::exposure_auto), 0u);
  EXPECT_EQ(reg(rich::gain_auto), 0u);
  EXPECT_FLOAT_EQ(real(rich::black_level), 1.5f);
  EXPECT_FLOAT_EQ(real(rich::gamma), 0.5f);
  EXPECT_EQ(reg(rich::gamma_enable), 1u);
}

TEST_F(RichCamera, TemperatureAndNetworkTime) {
  options_.gige.ptp = true;
  write(rich::temperature, 41.5f);
  write(rich::ptp_status, std::uint32_t{2});
  GigeCamera camera(options_);
  camera.start();
  EXPECT_EQ(reg(rich::ptp_enable), 1u);
  EXPECT_FALSE(camera.statistics().temperature_c);
  ASSERT_TRUE(triggered_frame(camera));
  camera.check();
  EXPECT_EQ(camera.statistics().temperature_c, 41.5);
  EXPECT_EQ(camera.statistics().ptp_state, "Slave");
  const auto frame = triggered_frame(camera);
  ASSERT_TRUE(frame);
  EXPECT_TRUE(frame->network_time);
}

// The fake camera sends none: they are asked for, and frames without them are taken.
TEST_F(RichCamera, ChunksAreAskedFor) {
  GigeCamera camera(options_);
  camera.start();
  EXPECT_EQ(reg(rich::chunk_mode), 1u);
  EXPECT_EQ(reg(rich::chunk_enable), 1u);
  EXPECT_EQ(reg(rich::chunk_selector), 2u);
  EXPECT_TRUE(triggered_frame(camera));
}

TEST_F(RichCamera, SettingsAreThereAgainAfterPowerLoss) {
  options_.exposure_us = 2500;
  options_.black_level = 1.5;
  std::optional<GigeCamera> camera(options_);
  camera->start();
  write(rich::exposure_us, std::uint32_t{7000});
  simulated_.server().stop_camera(0);
  simulated_.server().start_camera(0);
  EXPECT_NE(reg(rich::exposure_us), 2500u);
  EXPECT_THROW(camera->check(), DeviceError);
  camera.reset();
  camera.emplace(options_);
  camera->start();
  EXPECT_EQ(reg(rich::exposure_us), 2500u);
  EXPECT_FLOAT_EQ(real(rich::black_level), 1.5f);
  EXPECT_TRUE(triggered_frame(*camera));
}

// The library's own description has none of these.
TEST(PlainCamera, SaysWhichFeatureItLacks) {
  NumberedCameras simulated(1, 64, 48);
  const auto message = [&](auto change) {
    CameraOptions options = simulated.options(0);
    change(options);
    return failure([&] { const GigeCamera camera(options); }).second;
  };
  EXPECT_THAT(message([](CameraOptions& o) { o.black_level = 1; }),
              HasSubstr("has no feature BlackLevel; remove black_level from the cell file"));
  EXPECT_THAT(message([](CameraOptions& o) { o.gamma = 1; }),
              HasSubstr("has no feature Gamma; remove gamma from the cell file"));
  EXPECT_THAT(message([](CameraOptions& o) { o.gige.ptp = true; }),
              HasSubstr("has no feature PtpEnable; remove network.ptp from the cell file"));
  EXPECT_THAT(message([](CameraOptions& o) { o.format = PixelFormat::mono12; }),
              HasSubstr("does not take pixel format Mono12"));
  EXPECT_THAT(message([](CameraOptions& o) { o.format = PixelFormat::mjpeg; }),
              HasSubstr("sends no yuyv and no mjpeg"));
  EXPECT_THAT(message([](CameraOptions& o) { o.trigger = TriggerSource::line; }),
              HasSubstr("has no trigger line Line1"));
}

TEST(PlainCamera, SixteenBit) {
  NumberedCameras simulated(1);
  CameraOptions options = simulated.options(0);
  options.format = PixelFormat::mono16;
  GigeCamera camera(options);
  camera.start();
  const std::uint64_t scene = simulated.new_scene();
  const auto frame = triggered_frame(camera);
  ASSERT_TRUE(frame);
  EXPECT_EQ(number_of(shallow(*frame, 16)).scene, scene);
}

}  // namespace
}  // namespace zeropose
