#include "measure/picture_checks.h"

#include <algorithm>

#include "calib/words.h"

namespace zeropose {

std::size_t place_of(std::span<const CameraImage> images, std::size_t camera) {
  return static_cast<std::size_t>(std::ranges::find(images, camera, &CameraImage::camera) - images.begin());
}

const ImageView* image_of(std::span<const CameraImage> images, std::size_t camera) {
  const std::size_t place = place_of(images, camera);
  return place < images.size() ? &images[place].image : nullptr;
}

std::vector<PictureHealth> health_of(std::span<const CameraImage> images) {
  std::vector<PictureHealth> health;
  for (const CameraImage& image : images)
    health.push_back(image.image.data != nullptr ? picture_health(image.image) : PictureHealth{});
  return health;
}

Verdict check_picture(std::span<const CameraImage> images, std::span<const PictureHealth> health,
                      std::size_t index, const CalibratedCamera& camera) {
  const ImageView* image = image_of(images, index);
  if (image == nullptr || image->data == nullptr)
    return {Code::camera_missing, "there is no picture of " + camera.name};
  if (image->width_px != camera.model.width_px || image->height_px != camera.model.height_px)
    return {Code::frame_wrong_size, camera.name + " delivered " + number(image->width_px) + " x " +
                                        number(image->height_px) + " px, it is calibrated for " +
                                        number(camera.model.width_px) + " x " +
                                        number(camera.model.height_px)};
  return check_image(health[place_of(images, index)], camera.name);
}

}  // namespace zeropose
