// Pixels, fields and settings of V4L2 cameras, against pictures of our own and against v4l2-ctl.
#include <gmock/gmock.h>

#include <regex>

#include "drivers/v4l2_discovery.h"
#include "tests/guest/vivid.h"

namespace zeropose {
namespace {

using testing::HasSubstr;

struct Looped {
  PixelFormat format;
  std::string pixels;
  int white, width_px, height_px;
};

class VividPixels : public Vivid, public testing::WithParamInterface<Looped> {};

TEST_P(VividPixels, AreOursToTheLastBit) {
  const Looped& looped = GetParam();
  ShownPicture shown = shown_by(1, looped.width_px, looped.height_px);
  shown.pixels = looped.pixels;
  shown.pixel_bytes = looped.pixels == "GREY" ? 1 : 2;
  V4l2Output output(shown);
  const auto picture = random_picture(7, output.shown().size());
  std::ranges::copy(picture, output.shown().begin());
  CameraOptions options = options_of(1, looped.width_px, looped.height_px);
  options.format = looped.format;
  V4l2Camera camera(options);
  camera.start();
  const Frame frame = grab(camera);
  EXPECT_EQ(frame.white, looped.white);
  ASSERT_EQ(frame.width_px, looped.width_px);
  ASSERT_EQ(frame.height_px, looped.height_px);
  std::vector<std::uint8_t> expected = picture;
  if (looped.format == PixelFormat::yuyv) {
    expected.clear();
    for (std::size_t i = 0; i < picture.size(); i += 2) expected.push_back(picture[i]);
  }
  EXPECT_TRUE(shows(frame, expected));
  expected[expected.size() / 2] ^= 1;
  EXPECT_FALSE(shows(frame, expected)) << "the comparison sees a single bit";
  EXPECT_GT(frame.received, frame.triggered);
  EXPECT_EQ(camera.statistics().frames, 1U);
  EXPECT_THAT(output_of("v4l2-ctl -d " + capture_device(1) + " --get-fmt-video"),
              HasSubstr(std::to_string(looped.width_px) + "/" + std::to_string(looped.height_px)));
  EXPECT_THAT(output_of("v4l2-ctl -d " + capture_device(1) + " --get-fmt-video"),
              HasSubstr("'" + looped.pixels));
}

INSTANTIATE_TEST_SUITE_P(Formats, VividPixels,
                         testing::Values(Looped{PixelFormat::mono8, "GREY", 255, 768, 572},
                                         Looped{PixelFormat::mono8, "GREY", 255, 1280, 1024},
                                         Looped{PixelFormat::mono10, "Y10 ", 1023, 768, 572},
                                         Looped{PixelFormat::mono12, "Y12 ", 4095, 768, 572},
                                         Looped{PixelFormat::mono16, "Y16 ", 65535, 1280, 1024},
                                         Looped{PixelFormat::yuyv, "YUYV", 255, 768, 572}));

// Every row of a field of alternating lines is the same grey; the two fields are black and white. The first
// line of a 625-line picture, the top field's, carries data beside the picture (WSS), which vivid draws as
// noise.
class VividFields : public Vivid, public testing::WithParamInterface<std::string> {
 protected:
  void TearDown() override { set_control(0, "test_pattern", 0); }

  static std::vector<int> rows(Fields fields, int height_px) {
    CameraOptions options = options_of(0, 720, height_px);
    options.v4l2.input = 1;
    options.v4l2.fields = fields;
    options.v4l2.controls = {{"Loop Video", 0}, {"Test Pattern", 15}, {"osd_text_mode", 2}};
    V4l2Camera camera(options);
    camera.start();
    const Frame frame = grab(camera);
    std::vector<int> greys;
    for (int v = 1; v < frame.height_px; ++v) {
      EXPECT_TRUE(std::ranges::all_of(frame.row(v), [&](auto grey) { return grey == frame.row(v)[0]; }));
      greys.push_back(frame.row(v)[0]);
    }
    return greys;
  }
};

TEST_P(VividFields, AreTakenApart) {
  output_of("v4l2-ctl -d " + capture_device(0) + " --set-input 1 --set-standard pal");
  output_of("v4l2-ctl -d " + capture_device(0) + " --set-fmt-video width=720,height=576,field=" + GetParam());
  const auto top = rows(Fields::top, 288), bottom = rows(Fields::bottom, 288);
  ASSERT_EQ(top.size(), 287U);
  EXPECT_GT(std::abs(top[0] - bottom[0]), 200);
  EXPECT_EQ(std::ranges::count(top, top[0]), 287);
  EXPECT_EQ(std::ranges::count(bottom, bottom[0]), 287);
  if (GetParam() != "interlaced") return;
  const auto both = rows(Fields::both, 576);
  ASSERT_EQ(both.size(), 575U);
  for (std::size_t i = 0; i < 575; ++i) EXPECT_EQ(both[i], i % 2 == 0 ? bottom[0] : top[0]) << i;
}

INSTANTIATE_TEST_SUITE_P(Orders, VividFields,
                         testing::Values("interlaced", "interlaced_bt", "seq_tb", "seq_bt", "alternate"));

TEST_F(Vivid, FieldsOfAProgressivePictureAreRefused) {
  CameraOptions options = options_of(1, 1280, 360);
  options.v4l2.fields = Fields::top;
  const V4l2Output output(shown_by(1, 1280, 720));
  fault_of_opening(options, "not interlaced");
}

TEST_F(Vivid, PlanesGiveTheSamePixels) {
  CameraOptions options = options_of(4, 1280, 720);
  options.v4l2.controls = {{"test_pattern", 5}, {"osd_text_mode", 2}};
  V4l2Camera camera(options);
  camera.start();
  const Frame black = grab(camera);
  set_control(4, "test_pattern", 6);
  const Frame white = grab(camera);
  const auto only = [](const Frame& frame, int low, int high) {
    for (int v = 0; v < frame.height_px; ++v)
      for (const int grey : frame.row(v))
        if (grey < low || grey > high) return false;
    return true;
  };
  EXPECT_TRUE(only(black, 0, 20));
  EXPECT_TRUE(only(white, 230, 255));
}

TEST_F(Vivid, BeginsWhereItShall) {
  V4l2Output output(shown_by(1, 800, 600));
  const auto picture = random_picture(3, output.shown().size());
  std::ranges::copy(picture, output.shown().begin());
  CameraOptions options = options_of(1, 640, 400);
  options.x_px = 32;
  options.y_px = 50;
  V4l2Camera camera(options);
  camera.start();
  const Frame frame = grab(camera);
  for (int v = 0; v < 400; ++v)
    ASSERT_TRUE(std::ranges::equal(frame.row(v), std::span(picture).subspan((50UL + v) * 800 + 32, 640)))
        << v;
}

TEST_F(Vivid, ControlsAreSetByNameAndReadBack) {
  CameraOptions options = options_of(2, 1280, 720);
  options.gain = 42;
  options.v4l2.controls = {{"Brightness", 77}, {"HORIZONTAL-FLIP", 1}, {"menu", 4}};
  output_of("v4l2-ctl -d " + capture_device(2) + " --set-dv-bt-timings index=4");
  const std::string format = output_of("v4l2-ctl -d " + capture_device(2) + " --get-fmt-video");
  std::smatch size;
  ASSERT_TRUE(std::regex_search(format, size, std::regex("(\\d+)/(\\d+)")));
  options.width_px = std::stoi(size[1]);
  options.height_px = std::stoi(size[2]);
  const V4l2Camera camera(options);
  const std::string said = output_of("v4l2-ctl -d " + capture_device(2) +
                                     " --get-ctrl brightness,horizontal_flip,menu,gain,gain_automatic");
  for (const char* line :
       {"brightness: 77", "horizontal_flip: 1", "menu: 4", "gain: 42", "gain_automatic: 0"})
    EXPECT_THAT(said, HasSubstr(line));
  options.v4l2.controls = {{"horizontal_flip", 0}, {"brightness", 128}};
  const auto with = [&](const char* name, int value) {
    CameraOptions changed = options;
    changed.v4l2.controls.push_back({name, value});
    return changed;
  };
  fault_of_opening(with("no such thing", 1), "has no control 'no such thing'");
  fault_of_opening(with("Brightness", 256), "it takes 0 to 255");
  fault_of_opening(with("menu", 2), "does not take 2");
  CameraOptions exposed = options;
  exposed.exposure_us = 1000;
  fault_of_opening(exposed, "remove exposure_us");
}

TEST_F(Vivid, ListsTheSameDevicesAsItsPeer) {
  const auto found = discover_v4l2();
  ASSERT_EQ(found.size(), 5U);
  const std::string said = output_of("v4l2-ctl --list-devices");
  for (int i = 0; i < 5; ++i) {
    const auto& camera = found[static_cast<std::size_t>(i)];
    EXPECT_EQ(camera.device, capture_device(i));
    EXPECT_EQ(camera.driver, "vivid");
    EXPECT_THAT(said, HasSubstr(camera.card + " (" + camera.bus + ")"));
    EXPECT_THAT(said, HasSubstr(camera.device));
  }
}

TEST_F(Vivid, ListsTheLinksThatStay) {
  std::filesystem::create_directories("/dev/v4l/by-path");
  std::error_code exists;
  std::filesystem::create_symlink("../../video12", "/dev/v4l/by-path/platform-vivid-index1", exists);
  const auto found = discover_v4l2();
  ASSERT_EQ(found.size(), 5U);
  EXPECT_EQ(found[1].by_path, "/dev/v4l/by-path/platform-vivid-index1");
  EXPECT_EQ(found[0].by_path, "");
  EXPECT_EQ(found[1].by_id, "");
}

TEST_F(Vivid, WhatCannotBeSetIsRefusedWithBothSizes) {
  EXPECT_EQ(fault_of_opening(options_of(1, 9, 572), "the cell file wants 9x572"), DeviceFault::wrong_size);
  CameraOptions jpeg = options_of(1);
  jpeg.format = PixelFormat::mjpeg;
  EXPECT_EQ(fault_of_opening(jpeg, "does not deliver MJPG"), DeviceFault::wrong_size);
  CameraOptions packed = options_of(1);
  packed.format = PixelFormat::mono12_packed;
  fault_of_opening(packed, "mono8, mono10, mono12, mono16, yuyv and mjpeg");
  CameraOptions line = options_of(1);
  line.trigger = TriggerSource::line;
  const V4l2Output output(shown_by(1));
  fault_of_opening(line, "no trigger line");
  CameraOptions input = options_of(1);
  input.v4l2.input = 7;
  fault_of_opening(input, "has no input 7");
}

TEST_F(Vivid, WhatIsNoCameraIsSaidSo) {
  CameraOptions options = options_of(1);
  options.v4l2.device = output_device(1);
  fault_of_opening(options, "is no capture device");
  options.v4l2.device = "/dev/null";
  fault_of_opening(options, "is no V4L2 device");
  options.v4l2.device = "/dev/video99";
  EXPECT_EQ(fault_of_opening(options, "is not there"), DeviceFault::missing);
}

}  // namespace
}  // namespace zeropose
