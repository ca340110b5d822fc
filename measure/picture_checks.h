// The pictures of a measurement before anything is looked for in them. Internal to the room.
#pragma once

#include <array>
#include <span>
#include <vector>

#include "measure/measurement.h"
#include "measure/security.h"

namespace zeropose {

// Its place among the images; their number: there is none.
std::size_t place_of(std::span<const CameraImage> images, std::size_t camera);

// nullptr: there is none.
const ImageView* image_of(std::span<const CameraImage> images, std::size_t camera);

// One per image.
std::vector<PictureHealth> health_of(std::span<const CameraImage> images);

// There is a picture of this camera (index and calibration), as large as calibrated, neither white nor black:
// camera_missing, frame_wrong_size, and the codes of check_image(). `health` is that of the images.
Verdict check_picture(std::span<const CameraImage> images, std::span<const PictureHealth> health,
                      std::size_t index, const CalibratedCamera& camera);

// What the finder says of marks and edges that the picture spoils, and the code that the picture then gets
// (M6.1).
struct Spoilt {
  MarkStatus status;
  Code code;
};
inline constexpr std::array spoilt_by{Spoilt{MarkStatus::blurred, Code::image_blurred},
                                      Spoilt{MarkStatus::saturated, Code::image_saturated}};

}  // namespace zeropose
