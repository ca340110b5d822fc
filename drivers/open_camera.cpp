#include "drivers/camera.h"
#include "drivers/gige_camera.h"

namespace zeropose {

CameraStatistics operator+(const CameraStatistics& a, const CameraStatistics& b) {
  return {a.frames + b.frames,
          a.timeouts + b.timeouts,
          a.damaged + b.damaged,
          a.wrong_size + b.wrong_size,
          a.stale + b.stale,
          a.renewals + b.renewals,
          a.failures + b.failures,
          a.underruns + b.underruns,
          a.resent_packets + b.resent_packets,
          a.missing_packets + b.missing_packets};
}

std::unique_ptr<Camera> open_camera(const CameraOptions& options) {
  return std::make_unique<GigeCamera>(options);
}

}  // namespace zeropose
