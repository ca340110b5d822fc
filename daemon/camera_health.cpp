#include "daemon/camera_health.h"

#include <spdlog/spdlog.h>

namespace zeropose {
namespace {

// One warning when a figure has left its band, one line when it is back.
void follow(HealthTrend& trend, double value, const std::string& camera, const char* what) {
  const bool before = trend.changed;
  trend = followed(trend, value);
  if (trend.changed != before)
    spdlog::log(trend.changed ? spdlog::level::warn : spdlog::level::info, "{}: {} {}: {:.2f}, was {:.2f}",
                camera, what, trend.changed ? "has changed" : "is as before", trend.mean, trend.first);
}

}  // namespace

void follow_health(std::vector<CameraHealth>& health, std::span<const CameraImage> images,
                   const Measurement& measurement, const Job& job, const Cell& cell) {
  for (std::size_t i = 0; i < images.size() && i < measurement.health.size(); ++i) {
    const std::size_t camera = device_of(job, images[i].camera, cell.cameras.size());
    CameraHealth& known = health.at(camera);
    const std::string& name = cell.cameras[camera].name;
    known.seen = true;
    known.picture = measurement.health[i];
    follow(known.noise, known.picture.noise_grey, name, "the noise of its pictures (grey levels)");
    if (const auto blur_px = mark_blur_px(measurement.findings, job, images[i].camera))
      follow(known.focus, *blur_px, name, "the focus (blur of its marks, px)");
  }
}

}  // namespace zeropose
