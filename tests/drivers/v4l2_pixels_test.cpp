// Pixels that V4L2 devices send as something else than grey levels; OpenCV makes the JPEG pictures.
#include "drivers/v4l2_pixels.h"

#include <gtest/gtest.h>

#include <opencv2/imgcodecs.hpp>

namespace zeropose {
namespace {

TEST(V4l2Pixels, BrightnessIsEverySecondByteOfEachRow) {
  const std::vector<std::uint8_t> bytes{1, 90, 2, 91, 77, 77, 3, 92, 4, 93};  // two bytes of padding
  EXPECT_EQ(brightness_of_yuyv(bytes, 2, 2, 6), (std::vector<std::uint8_t>{1, 2, 3, 4}));
}

cv::Mat ramp() {
  cv::Mat picture(48, 64, CV_8UC1);
  for (int v = 0; v < picture.rows; ++v)
    for (int u = 0; u < picture.cols; ++u)
      picture.at<std::uint8_t>(v, u) = static_cast<std::uint8_t>(2 * u + v);
  return picture;
}

std::vector<std::uint8_t> jpeg_of_ramp() {
  std::vector<std::uint8_t> bytes;
  cv::imencode(".jpg", ramp(), bytes, {cv::IMWRITE_JPEG_QUALITY, 95});
  return bytes;
}

TEST(V4l2Pixels, AJpegIsDecodedAlsoWithZerosBehindIt) {
  std::vector<std::uint8_t> bytes = jpeg_of_ramp();
  bytes.resize(bytes.size() + 100);
  const auto decoded = decode_jpeg(bytes);
  ASSERT_TRUE(decoded);
  ASSERT_EQ(decoded->width_px, 64);
  ASSERT_EQ(decoded->height_px, 48);
  const cv::Mat expected = ramp();
  for (std::size_t i = 0; i < decoded->pixels.size(); ++i)
    EXPECT_NEAR(decoded->pixels[i], expected.data[i], 4) << i;
}

TEST(V4l2Pixels, AJpegWithoutItsEndIsRefused) {
  const std::vector<std::uint8_t> whole = jpeg_of_ramp();
  for (const std::size_t size : {std::size_t{0}, std::size_t{1}, whole.size() / 2, whole.size() - 1})
    EXPECT_FALSE(decode_jpeg(std::span(whole).first(size))) << size;
  std::vector<std::uint8_t> hollow = whole;  // begins and ends well, with nothing between
  std::fill(hollow.begin() + 2, hollow.end() - 2, std::uint8_t{0});
  EXPECT_FALSE(decode_jpeg(hollow));
}

}  // namespace
}  // namespace zeropose
