#include <utility>

#include "drivers/camera.h"
#include "drivers/folder_camera.h"
#include "drivers/gige_camera.h"
#include "drivers/v4l2_camera.h"

namespace zeropose {

CameraStatistics operator+(const CameraStatistics& a, const CameraStatistics& b) {
  return {a.frames + b.frames,
          a.timeouts + b.timeouts,
          a.damaged + b.damaged,
          a.wrong_size + b.wrong_size,
          a.stale + b.stale,
          a.skipped + b.skipped,
          a.renewals + b.renewals,
          a.failures + b.failures,
          a.underruns + b.underruns,
          a.resent_packets + b.resent_packets,
          a.missing_packets + b.missing_packets,
          b.temperature_c ? b.temperature_c : a.temperature_c,
          b.ptp_state.empty() ? a.ptp_state : b.ptp_state};
}

std::shared_ptr<const std::uint8_t> own_pixels(std::vector<std::uint8_t> pixels) {
  const auto owner = std::make_shared<const std::vector<std::uint8_t>>(std::move(pixels));
  return {owner, owner->data()};
}

std::string place_of(const CameraOptions& camera) {
  switch (camera.driver) {
    case CameraDriver::gige:
      if (!camera.gige.address.empty()) return camera.gige.address;
      return camera.gige.serial.empty() ? camera.gige.user_name : "serial " + camera.gige.serial;
    case CameraDriver::v4l2:
      return camera.v4l2.device;
    case CameraDriver::folder:
      return camera.folder.path.string();
  }
  return {};
}

std::string title_of(const CameraOptions& camera) {
  return "camera " + camera.name + " (" + place_of(camera) + ")";
}

std::unique_ptr<Camera> open_camera(const CameraOptions& options) {
  switch (options.driver) {
    case CameraDriver::gige:
      return std::make_unique<GigeCamera>(options);
    case CameraDriver::v4l2:
      return std::make_unique<V4l2Camera>(options);
    case CameraDriver::folder:
      return std::make_unique<FolderCamera>(options);
  }
  throw DeviceError(title_of(options) + ": this build has no such driver");
}

}  // namespace zeropose
