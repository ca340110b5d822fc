#include "drivers/gige_pixels.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstring>

#include "tests/drivers/gige_test.h"

namespace zeropose {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

std::vector<std::uint16_t> grey(PixelFormat format, const std::vector<std::uint8_t>& bytes,
                                std::size_t pixels) {
  const std::vector<std::uint8_t> raw =
      unpacked(gige_pixels({.name = "camera1", .format = format}), bytes, pixels);
  std::vector<std::uint16_t> values(raw.size() / 2);
  std::memcpy(values.data(), raw.data(), raw.size());
  return values;
}

// 0xABC and 0x123: upper eight bits outside, lower four in the middle, the first pixel's in the lower half.
TEST(GigePixels, Mono12Packed) {
  EXPECT_THAT(grey(PixelFormat::mono12_packed, {0xab, 0x3c, 0x12}, 2), ElementsAre(0xabc, 0x123));
  EXPECT_THAT(grey(PixelFormat::mono12_packed, {0xff, 0xff, 0xff}, 2), ElementsAre(4095, 4095));
}

// 10 bits: abcdefgh ij; what the other bits of the middle byte say is none of the pixel's business.
TEST(GigePixels, Mono10Packed) {
  EXPECT_THAT(grey(PixelFormat::mono10_packed, {0b10110011, 0b00100001, 0b01010101}, 2),
              ElementsAre(0b1011001101, 0b0101010110));
  EXPECT_THAT(grey(PixelFormat::mono10_packed, {0xff, 0xff, 0xff}, 2), ElementsAre(1023, 1023));
  EXPECT_THAT(grey(PixelFormat::mono10_packed, {0x00, 0xcc, 0x00}, 2), ElementsAre(0, 0));
}

TEST(GigePixels, AnOddPictureEndsInTwoBytes) {
  const GigePixels& format = gige_pixels({.name = "camera1", .format = PixelFormat::mono12_packed});
  EXPECT_EQ(format.picture_bytes(3, 1), 5u);
  EXPECT_EQ(format.picture_bytes(3, 2), 9u);  // pairs run over the end of a row
  EXPECT_THAT(grey(PixelFormat::mono12_packed, {0xab, 0x3c, 0x12, 0xde, 0x0f}, 3),
              ElementsAre(0xabc, 0x123, 0xdef));
}

TEST(GigePixels, EveryBitOfAPairHasItsOwnPlace) {
  for (const PixelFormat format : {PixelFormat::mono10_packed, PixelFormat::mono12_packed}) {
    const int bits = format == PixelFormat::mono10_packed ? 10 : 12;
    unsigned first = 0, second = 0;
    for (unsigned bit = 0; bit < 24; ++bit) {
      std::vector<std::uint8_t> bytes(3);
      bytes[bit / 8] = static_cast<std::uint8_t>(1u << bit % 8);
      const auto pair = grey(format, bytes, 2);
      EXPECT_TRUE(pair[0] == 0 || pair[1] == 0) << bit;
      EXPECT_EQ(first & pair[0], 0u);
      EXPECT_EQ(second & pair[1], 0u);
      first |= pair[0];
      second |= pair[1];
    }
    EXPECT_EQ(first, (1u << bits) - 1);
    EXPECT_EQ(second, (1u << bits) - 1);
  }
}

TEST(GigePixels, WhatNoGigeCameraSends) {
  for (const PixelFormat format : {PixelFormat::yuyv, PixelFormat::mjpeg})
    EXPECT_THAT(failure([&] { (void)gige_pixels({.name = "camera1", .format = format}); }).second,
                HasSubstr("choose pixel_format mono8, mono10, mono12, mono16, mono10_packed or "
                          "mono12_packed"));
}

}  // namespace
}  // namespace zeropose
