// What a picture says about lens, light and camera, against drawn pictures with known truth.
#include "measure/picture_health.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/mark_picture.h"

namespace zeropose {
namespace {

using test::Drawing;
using test::Picture;
using test::Pixels;

// Dark discs on a plate, as most cells show them.
Picture discs(double blur_px, double contrast = 100) {
  Drawing drawing;
  drawing.width_px = 320;
  drawing.height_px = 240;
  drawing.background = 60 + contrast;
  drawing.blur_sigma_px = blur_px;
  for (const auto& [u, v, diameter] :
       {std::tuple{70.3, 61.2, 44.0}, {231.8, 80.4, 52.0}, {150.1, 171.7, 60.0}})
    drawing.figures.push_back(test::ellipse({u, v}, diameter, 0.9, 0.3, 60));
  return paint(drawing);
}

PictureHealth exposed(const Picture& picture, double noise, std::mt19937_64& random) {
  return picture_health(expose(picture, noise, random).view());
}

Pixels flat(int grey, int width_px = 200, int height_px = 160) {
  return {width_px, height_px, width_px,
          std::vector<std::uint8_t>(static_cast<std::size_t>(width_px * height_px),
                                    static_cast<std::uint8_t>(grey))};
}

// The median of 2560 second differences (efficiency 0.37, neighbours correlated) scatters by 3.2 %; three
// times that is allowed. Rounding to whole greys is part of the noise.
TEST(PictureHealth, NoiseIsThatOfTheExposure) {
  std::mt19937_64 random(1);
  const Picture picture = discs(0.8);
  for (const double noise : {0.6, 1.0, 2.0, 4.0, 9.0}) {
    const double truth = std::sqrt(noise * noise + 1.0 / 12);
    for (int i = 0; i < 10; ++i) EXPECT_NEAR(exposed(picture, noise, random).noise_grey, truth, 0.1 * truth);
  }
}

TEST(PictureHealth, NoiseOfDeepPixels) {
  std::mt19937_64 random(2);
  for (const int white : {1023, 4095, 65535}) {
    std::vector<std::uint16_t> pixels(320 * 240);
    std::normal_distribution<double> count(0.4 * white, 2.0 / 255 * white);
    for (auto& pixel : pixels) pixel = static_cast<std::uint16_t>(std::lround(count(random)));
    const PictureHealth health =
        picture_health({reinterpret_cast<const std::uint8_t*>(pixels.data()), 320, 240, 640, white});
    EXPECT_NEAR(health.noise_grey, 2, 0.16) << white;
    EXPECT_NEAR(health.mean_grey, 0.4 * 255, 0.1) << white;
  }
}

TEST(PictureHealth, NoNoiseIsTheRoundingOfThePixels) {
  EXPECT_DOUBLE_EQ(picture_health(flat(100).view()).noise_grey, 1 / std::sqrt(12.0));
}

TEST(PictureHealth, SharesAndMeanAreExact) {
  Pixels pixels = flat(100, 200, 160);  // 50 x 40 are looked at
  for (int v = 0; v < 160; ++v)
    for (int u = 0; u < 200; ++u) {
      auto& grey = pixels.grey[static_cast<std::size_t>(200 * v + u)];
      if (u < 40) grey = static_cast<std::uint8_t>(v < 80 ? 254 : 255);
      if (u >= 100 && v >= 120) grey = static_cast<std::uint8_t>(u < 150 ? 12 : 0);
      if (u >= 40 && u < 60) grey = 253;
      if (u >= 60 && u < 80) grey = 13;
    }
  const PictureHealth health = picture_health(pixels.view());
  EXPECT_DOUBLE_EQ(health.saturated_share, 0.2);
  EXPECT_DOUBLE_EQ(health.dark_share, 0.125);
  EXPECT_NEAR(health.mean_grey,
              0.1 * 254 + 0.1 * 255 + 0.1 * 253 + 0.1 * 13 + 0.065 * 12 + (0.6 - 0.125) * 100, 1e-9);
}

TEST(PictureHealth, AnEmptyPictureIsDark) {
  const PictureHealth health = picture_health({});
  EXPECT_EQ(health.dark_share, 1);
  EXPECT_EQ(health.saturated_share, 0);
  EXPECT_FALSE(health.focus_px.has_value());
}

// Within a quarter of the truth from 0.6 to 6 px, whatever the contrast and the noise.
TEST(PictureHealth, FocusIsTheBlurWhateverContrastAndNoise) {
  std::mt19937_64 random(3);
  double before = 0;
  for (const double blur : {0.6, 0.9, 1.3, 1.9, 2.7, 4.0, 6.0}) {
    double mean = 0;
    int count = 0;
    for (const double contrast : {50, 100, 180})
      for (const double noise : {0.5, 1.0, 2.0}) {
        const auto focus = exposed(discs(blur, contrast), noise, random).focus_px;
        ASSERT_TRUE(focus.has_value()) << blur << ' ' << contrast << ' ' << noise;
        EXPECT_NEAR(*focus, blur, 0.25 * blur) << contrast << ' ' << noise;
        mean = (count * mean + *focus) / (count + 1);
        ++count;
      }
    EXPECT_GT(mean, 1.2 * before);
    before = mean;
  }
}

TEST(PictureHealth, NoiseAloneHasNoEdges) {
  std::mt19937_64 random(4);
  for (const double noise : {1.0, 3.0, 10.0})
    for (int i = 0; i < 10; ++i) {
      const Picture picture{320, 240, std::vector<double>(320 * 240, 120.0)};
      EXPECT_FALSE(exposed(picture, noise, random).focus_px.has_value()) << noise;
    }
}

HealthTrend after(HealthTrend trend, double value, int times) {
  while (times-- > 0) trend = followed(trend, value);
  return trend;
}

TEST(HealthTrend, AStepBeyondTheBandChangesItOnceItLasts) {
  HealthTrend trend = after({}, 2.0, 20);
  EXPECT_FALSE(trend.changed);
  EXPECT_DOUBLE_EQ(trend.ratio(), 1);
  EXPECT_FALSE(after(trend, 2.4, 100).changed);  // within
  EXPECT_FALSE(after(trend, 3.0, 8).changed);    // not yet
  EXPECT_TRUE(after(trend, 3.0, 20).changed);
  EXPECT_TRUE(after(trend, 1.0, 20).changed);                // sharper than at zero is a change, too
  EXPECT_FALSE(after(followed(trend, 40), 2.0, 3).changed);  // one picture
  trend = after(after(trend, 3.0, 20), 2.0, 20);
  EXPECT_FALSE(trend.changed);  // it came back
}

TEST(HealthTrend, TheFirstFewValuesAreTheMeasure) {
  HealthTrend trend;
  for (const double value : {1.0, 2.0, 3.0, 4.0, 5.0}) trend = followed(trend, value);
  EXPECT_DOUBLE_EQ(trend.first, 3);
  EXPECT_DOUBLE_EQ(trend.mean, 3);
}

}  // namespace
}  // namespace zeropose
