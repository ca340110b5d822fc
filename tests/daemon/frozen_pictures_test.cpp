// A camera that repeats its picture (spec 85 R4).
#include "daemon/frozen_pictures.h"

#include <gtest/gtest.h>

#include <random>

namespace zeropose {
namespace {

class Frozen : public testing::Test {
 protected:
  Frame frame(int middle_grey, int noise_grey) {
    Frame frame;
    frame.width_px = 64;
    frame.height_px = 48;
    frame.stride_bytes = 64;
    std::vector<std::uint8_t> pixels(64 * 48);
    std::uniform_int_distribution<int> noise(-noise_grey, noise_grey);
    for (auto& pixel : pixels)
      pixel = static_cast<std::uint8_t>(std::clamp(middle_grey + noise(random), 0, 255));
    frame.pixels = own_pixels(std::move(pixels));
    return frame;
  }

  std::mt19937 random{1};
  FrozenPictures pictures{2};
};

TEST_F(Frozen, LiveCamerasNeverRepeatAPicture) {
  for (int i = 0; i < 100; ++i) EXPECT_FALSE(pictures.repeats(0, frame(100, 2)));
}

TEST_F(Frozen, TheSamePictureAgainIsFoundForTheCameraThatSentIt) {
  const Frame stuck = frame(100, 2);
  EXPECT_FALSE(pictures.repeats(0, stuck));
  EXPECT_FALSE(pictures.repeats(1, stuck));
  EXPECT_TRUE(pictures.repeats(0, stuck));
  EXPECT_TRUE(pictures.repeats(0, stuck));
  EXPECT_FALSE(pictures.repeats(0, frame(100, 2)));
  EXPECT_FALSE(pictures.repeats(0, stuck));
}

TEST_F(Frozen, OneGreyLevelOfOnePixelTellsThemApart) {
  Frame live = frame(100, 2);
  pictures.repeats(0, live);
  std::vector<std::uint8_t> pixels(live.pixels.get(), live.pixels.get() + 64 * 48);
  pixels[32 * 64 + 17] ^= 1;
  live.pixels = own_pixels(std::move(pixels));
  EXPECT_FALSE(pictures.repeats(0, live));
}

// A cap on the lens and the sun in it have codes of their own.
TEST_F(Frozen, BlackAndWhitePicturesAreNotFrozen) {
  for (const int grey : {0, 12, 254, 255}) {
    EXPECT_FALSE(pictures.repeats(0, frame(grey, 0)));
    EXPECT_FALSE(pictures.repeats(0, frame(grey, 0)));
  }
}

}  // namespace
}  // namespace zeropose
