// The tables of zeropose calibrate sensor and zeropose teach (spec 92).
#pragma once

#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "config/config_error.h"
#include "config/pose_table.h"
#include "measure/sensor.h"

namespace zeropose {

// Columns point x_mm y_mm z_mm [sigma_mm], each point once. All throw ConfigError with every mistake.
std::vector<KnownPoint> load_known_points(const std::filesystem::path& path, double sigma_mm);

// Columns camera point u_px v_px [suu svv suv] and, with the poses X_RH of a hand, view. Sightings in the
// order in which they first appear.
std::vector<SensorSighting> load_sightings(const std::filesystem::path& path,
                                           std::span<const CalibratedCamera> cameras,
                                           std::span<const KnownPoint> points,
                                           const std::optional<NamedPoses>& hand);

// The same of points whose places are not known: the names in the order in which they first appear.
struct NamedSightings {
  std::vector<std::string> points;
  std::vector<SensorSighting> sightings;
};
NamedSightings load_sightings(const std::filesystem::path& path, std::span<const CalibratedCamera> cameras,
                              const NamedPoses& hand);

}  // namespace zeropose
