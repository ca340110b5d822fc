// A folder of pictures as a camera: order, depth, loop, rate, and what is wrong with its files.
#include "drivers/folder_camera.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <fstream>
#include <opencv2/imgcodecs.hpp>

#include "drivers/camera_worker.h"
#include "drivers/folder_listing.h"
#include "drivers/picture_file.h"

namespace zeropose {
namespace {

using namespace std::chrono_literals;
using std::chrono::steady_clock;
using testing::HasSubstr;

constexpr int width_px = 13, height_px = 7;

class FolderOfPictures : public testing::Test {
 protected:
  void SetUp() override {
    std::string name = (std::filesystem::temp_directory_path() / "zeropose-folder-XXXXXX").string();
    ASSERT_NE(::mkdtemp(name.data()), nullptr);
    folder = name;
    options.name = "camera1";
    options.driver = CameraDriver::folder;
    options.width_px = width_px;
    options.height_px = height_px;
    options.folder.path = folder;
  }
  void TearDown() override { std::filesystem::remove_all(folder); }

  void put(const std::string& name, int grey) {
    ASSERT_TRUE(
        cv::imwrite((folder / name).string(), cv::Mat(height_px, width_px, CV_8UC1, cv::Scalar(grey))));
  }
  void spoil(const std::string& name) { std::ofstream(folder / name) << "no picture"; }

  std::unique_ptr<Camera> started() {
    auto camera = open_camera(options);
    camera->start();
    return camera;
  }
  static Frame next(Camera& camera) {
    camera.trigger();
    std::optional<Frame> frame = camera.grab(steady_clock::now() + 10s);
    if (!frame) throw std::runtime_error("no frame");
    return *std::move(frame);
  }
  static int grey_of(Camera& camera) { return next(camera).row(height_px - 1)[width_px - 1]; }
  static std::vector<int> greys_of(Camera& camera, int count) {
    std::vector<int> greys;
    while (count-- > 0) greys.push_back(grey_of(camera));
    return greys;
  }
  // The message of the fault that the next grab must end with.
  static std::string refusal(Camera& camera, DeviceFault fault) {
    try {
      next(camera);
    } catch (const DeviceError& error) {
      EXPECT_EQ(error.fault(), fault) << error.what();
      return error.what();
    }
    return "no refusal";
  }
  std::string start_refusal() {
    try {
      started();
    } catch (const DeviceError& error) {
      EXPECT_EQ(error.fault(), DeviceFault::missing);
      return error.what();
    }
    return "no refusal";
  }

  std::filesystem::path folder;
  CameraOptions options;
};

TEST(FolderListing, NumbersInNamesCountAsNumbers) {
  const std::vector<std::string> sorted{
      "a", "a1", "a01b", "a2b", "a10", "a10b2", "a10b10", "a99999999999999999998", "a99999999999999999999",
      "b"};
  for (std::size_t i = 0; i < sorted.size(); ++i)
    for (std::size_t k = 0; k < sorted.size(); ++k)
      EXPECT_EQ(natural_less(sorted[i], sorted[k]), i < k) << sorted[i] << ' ' << sorted[k];
  EXPECT_NE(natural_less("img01", "img1"), natural_less("img1", "img01"));
}

TEST_F(FolderOfPictures, ComeInTheOrderOfTheirNumbersAgainAndAgain) {
  put("img10.png", 30);
  put("img2.PGM", 20);
  put("img1.bmp", 10);
  put("img11.tiff", 40);
  put("img12.tif", 50);
  std::ofstream(folder / "readme.txt") << "no picture, nobody minds";
  put(".img0.png", 99);
  const auto camera = started();
  EXPECT_EQ(greys_of(*camera, 7), (std::vector<int>{10, 20, 30, 40, 50, 10, 20}));
  const Frame frame = next(*camera);
  EXPECT_EQ(frame.sequence, 8U);
  EXPECT_EQ(frame.camera, "camera1");
  EXPECT_EQ(frame.white, 255);
  EXPECT_LE(frame.triggered, frame.received);
  EXPECT_EQ(camera->statistics().frames, 8U);
}

TEST_F(FolderOfPictures, SixteenBitsAreKeptWithTheirWhite) {
  cv::Mat deep(height_px, width_px, CV_16UC1, cv::Scalar(700));
  deep.at<std::uint16_t>(2, 3) = 901;
  for (const char* name : {"a.png", "b.tiff", "c.pgm"}) cv::imwrite((folder / name).string(), deep);
  const auto expect_white = [this](PixelFormat format, int white) {
    options.format = format;
    const auto camera = started();
    for (int i = 0; i < 3; ++i) {
      const Frame frame = next(*camera);
      EXPECT_EQ(frame.white, white);
      ASSERT_EQ(frame.row_bytes(), 2U * width_px);
      std::uint16_t value = 0;
      std::memcpy(&value, frame.row(2).data() + 6, 2);
      EXPECT_EQ(value, 901);
    }
  };
  expect_white(PixelFormat::mono8, 1023);  // the bits that are used
  expect_white(PixelFormat::mono12, 4095);
  expect_white(PixelFormat::mono16, 65535);
}

TEST_F(FolderOfPictures, ColourBecomesItsLuminance) {
  cv::imwrite((folder / "red.png").string(), cv::Mat(height_px, width_px, CV_8UC3, cv::Scalar(0, 0, 200)));
  EXPECT_NEAR(grey_of(*started()), 0.299 * 200, 1);
}

TEST_F(FolderOfPictures, AFrameWrittenAsAPngComesBackBitByBit) {
  for (const int white : {255, 4095}) {
    Frame frame;
    frame.width_px = width_px;
    frame.height_px = height_px;
    frame.white = white;
    frame.stride_bytes = static_cast<std::ptrdiff_t>(frame.row_bytes()) + 6;
    std::vector<std::uint8_t> pixels(static_cast<std::size_t>(frame.stride_bytes) * height_px);
    for (std::size_t i = 0; i < pixels.size(); ++i) pixels[i] = static_cast<std::uint8_t>((i * 37) & 15);
    frame.pixels = own_pixels(std::move(pixels));
    const auto png = encode_png(frame);
    std::ofstream(folder / "a.png", std::ios::binary)
        .write(reinterpret_cast<const char*>(png.data()), static_cast<std::streamsize>(png.size()));
    options.format = white == 255 ? PixelFormat::mono8 : PixelFormat::mono12;
    const Frame back = next(*started());
    EXPECT_EQ(back.white, white);
    for (int v = 0; v < height_px; ++v) EXPECT_TRUE(std::ranges::equal(back.row(v), frame.row(v)));
  }
}

TEST_F(FolderOfPictures, WithoutLoopTheEndIsSaidAndMoreIsTaken) {
  options.folder.loop = false;
  put("1.png", 10);
  put("2.png", 20);
  const auto camera = started();
  EXPECT_EQ(greys_of(*camera, 2), (std::vector<int>{10, 20}));
  for (int i = 0; i < 2; ++i)
    EXPECT_THAT(refusal(*camera, DeviceFault::damaged_frame), HasSubstr("all 2 pictures were used"));
  put("0.png", 5);  // before those used: not asked for any more
  put("5.png", 50);
  put("6.png", 60);
  EXPECT_EQ(greys_of(*camera, 2), (std::vector<int>{50, 60}));
}

// A camera that is lost is opened anew, which would begin a replay from the start.
TEST_F(FolderOfPictures, TheEndIsNoLossOfTheCamera) {
  options.folder.loop = false;
  put("1.png", 10);
  CameraWorker worker(options);
  while (worker.state() == CameraState::opening) std::this_thread::sleep_for(1ms);
  EXPECT_EQ(worker.request(steady_clock::now() + 10s).wait().status, GrabStatus::ok);
  for (int i = 0; i < 5; ++i)
    EXPECT_EQ(worker.request(steady_clock::now() + 10s).wait().status, GrabStatus::damaged);
  EXPECT_EQ(worker.state(), CameraState::alive);
}

TEST_F(FolderOfPictures, EachPassLooksAnew) {
  put("1.png", 10);
  put("3.png", 30);
  const auto camera = started();
  EXPECT_EQ(greys_of(*camera, 1), (std::vector<int>{10}));
  put("2.png", 20);
  EXPECT_EQ(greys_of(*camera, 4), (std::vector<int>{30, 10, 20, 30}));
  std::filesystem::remove(folder / "3.png");
  std::filesystem::remove(folder / "2.png");
  EXPECT_EQ(greys_of(*camera, 1), (std::vector<int>{10}));
}

TEST_F(FolderOfPictures, BrokenAndWrongFilesAreNamedAndTheNextIsTaken) {
  put("1.png", 10);
  spoil("2.png");
  std::ofstream(folder / "3.png");  // empty
  cv::imwrite((folder / "4.png").string(), cv::Mat(8, 12, CV_8UC1, cv::Scalar(40)));
  put("5.png", 50);
  const auto camera = started();
  EXPECT_EQ(grey_of(*camera), 10);
  EXPECT_THAT(refusal(*camera, DeviceFault::damaged_frame), HasSubstr("2.png is no picture"));
  EXPECT_THAT(refusal(*camera, DeviceFault::damaged_frame), HasSubstr("3.png is no picture"));
  EXPECT_THAT(refusal(*camera, DeviceFault::wrong_size),
              HasSubstr("4.png has 12 x 8 px, expected are 13 x 7 px"));
  EXPECT_EQ(grey_of(*camera), 50);
  EXPECT_EQ(camera->statistics().damaged, 2U);
  EXPECT_EQ(camera->statistics().wrong_size, 1U);
}

TEST_F(FolderOfPictures, NoFolderAndNoPicturesSayWhatToDo) {
  EXPECT_THAT(start_refusal(), HasSubstr("put png, tiff, bmp or pgm files of 13 x 7 px there"));
  std::filesystem::remove(folder);
  EXPECT_THAT(start_refusal(), HasSubstr("there is no such folder"));
}

TEST_F(FolderOfPictures, AFolderThatGoesIsMissing) {
  put("1.png", 10);
  const auto camera = started();
  std::filesystem::remove_all(folder);
  EXPECT_THROW(camera->check(), DeviceError);
}

TEST_F(FolderOfPictures, TriggersThatAFolderCannotHaveAreRefused) {
  put("1.png", 10);
  options.trigger = TriggerSource::line;
  EXPECT_THAT(start_refusal(), HasSubstr("a folder has no trigger line"));
  options.trigger = TriggerSource::free_run;
  EXPECT_THAT(start_refusal(), HasSubstr("needs frame_rate_hz"));
}

// By the clock: what nobody asked for in time is gone, and no picture comes twice.
TEST_F(FolderOfPictures, RunsFreelyAtItsRate) {
  for (int i = 0; i < 100; ++i) put(std::to_string(i) + ".png", i);
  options.trigger = TriggerSource::free_run;
  options.frame_rate_hz = 50;
  const auto camera = started();
  const auto begin = steady_clock::now();
  int before = -1;
  for (int i = 0; i < 5; ++i) {
    const int grey = grey_of(*camera);
    EXPECT_GT(grey, before);
    EXPECT_GE(steady_clock::now() - begin + 1ms, grey * 20ms);  // not before its turn
    before = grey;
  }
  std::this_thread::sleep_for(200ms);
  EXPECT_GE(grey_of(*camera), before + 10);
}

TEST_F(FolderOfPictures, AFreeRunThatIsSlowerThanTheDeadlineTimesOut) {
  put("1.png", 10);
  options.trigger = TriggerSource::free_run;
  options.frame_rate_hz = 0.01;
  const auto camera = started();
  camera->trigger();
  EXPECT_FALSE(camera->grab(steady_clock::now() + 20ms).has_value());
  EXPECT_EQ(camera->statistics().timeouts, 1U);
}

}  // namespace
}  // namespace zeropose
