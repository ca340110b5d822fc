#include "drivers/gige_pixels.h"

#include <array>
#include <bit>
#include <cstring>

#include "drivers/camera.h"

namespace zeropose {
namespace {

// Two bytes are sent with the lower one first: as the host has them, so that they need no copy.
static_assert(std::endian::native == std::endian::little);

// In the order of PixelFormat.
constexpr std::array<GigePixels, 6> formats{{{"Mono8", 0x01080001, 255, false},
                                             {"Mono10", 0x01100003, 1023, false},
                                             {"Mono12", 0x01100005, 4095, false},
                                             {"Mono16", 0x01100007, 65535, false},
                                             {"Mono10Packed", 0x010c0004, 1023, true},
                                             {"Mono12Packed", 0x010c0006, 4095, true}}};

}  // namespace

std::size_t GigePixels::picture_bytes(int width_px, int height_px) const {
  const std::size_t pixels = static_cast<std::size_t>(width_px) * static_cast<std::size_t>(height_px);
  if (packed) return (3 * pixels + 1) / 2;
  return white > 255 ? 2 * pixels : pixels;
}

const GigePixels& gige_pixels(const CameraOptions& camera) {
  const auto index = static_cast<std::size_t>(camera.format);
  if (index < formats.size()) return formats[index];
  throw DeviceError(title_of(camera) +
                    ": a gige camera sends no yuyv and no mjpeg; choose pixel_format mono8, mono10, mono12, "
                    "mono16, mono10_packed or mono12_packed in the cell file");
}

std::vector<std::uint8_t> unpacked(const GigePixels& format, std::span<const std::uint8_t> bytes,
                                   std::size_t pixels) {
  const int low_bits = format.white > 1023 ? 4 : 2;
  const unsigned low_mask = (1u << low_bits) - 1;
  std::vector<std::uint8_t> out(2 * pixels);
  const auto put = [&out](std::size_t pixel, unsigned grey) {
    const auto value = static_cast<std::uint16_t>(grey);
    std::memcpy(&out[2 * pixel], &value, sizeof value);
  };
  const std::uint8_t* in = bytes.data();
  for (std::size_t pixel = 0; pixel + 1 < pixels; pixel += 2, in += 3) {
    put(pixel, static_cast<unsigned>(in[0] << low_bits) | (in[1] & low_mask));
    put(pixel + 1, static_cast<unsigned>(in[2] << low_bits) | ((in[1] >> 4) & low_mask));
  }
  if (pixels % 2 != 0) put(pixels - 1, static_cast<unsigned>(in[0] << low_bits) | (in[1] & low_mask));
  return out;
}

}  // namespace zeropose
