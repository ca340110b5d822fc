// The pixel formats of GigE Vision cameras. Pure: numbers of the standard and how their bytes are laid out.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "drivers/camera_options.h"

namespace zeropose {

struct GigePixels {
  const char* name;    // as in the camera's feature PixelFormat
  std::uint32_t code;  // PFNC
  int white;           // the highest grey value
  bool packed;         // two pixels in three bytes

  // Of a whole picture. The packed ones run over the ends of rows: only the last pixel may waste half a byte.
  std::size_t picture_bytes(int width_px, int height_px) const;
};

// Throws DeviceError for a format that no GigE Vision camera sends, with those that they do.
const GigePixels& gige_pixels(const CameraOptions& camera);

// Mono10Packed and Mono12Packed of GigE Vision (not Mono10p and Mono12p, which are packed otherwise): the
// outer bytes hold the upper eight bits of the first and of the second pixel, the middle one the rest of the
// first in its lower half and the rest of the second in its upper half. Returns `pixels` grey values of two
// bytes in the host's order. Precondition: `bytes` holds so many.
std::vector<std::uint8_t> unpacked(const GigePixels& format, std::span<const std::uint8_t> bytes,
                                   std::size_t pixels);

}  // namespace zeropose
