#include "daemon/version.h"

#include <modbus/modbus-version.h>
#include <spdlog/version.h>

#include <Eigen/Core>
#include <nlohmann/json.hpp>
#include <opencv2/core/version.hpp>

namespace zeropose {
namespace {

std::string dotted(int major, int minor, int patch) {
  return std::to_string(major) + '.' + std::to_string(minor) + '.' + std::to_string(patch);
}

}  // namespace

std::string version_text(const std::string& program) {
  return program +
         " " ZEROPOSE_VERSION " (commit " ZEROPOSE_COMMIT ", build type " ZEROPOSE_BUILD_TYPE ")\n" +
         "Eigen " + dotted(EIGEN_WORLD_VERSION, EIGEN_MAJOR_VERSION, EIGEN_MINOR_VERSION) +
         ", OpenCV " CV_VERSION +
         ", Aravis " ZEROPOSE_ARAVIS_VERSION ", libmodbus " LIBMODBUS_VERSION_STRING ", spdlog " +
         dotted(SPDLOG_VER_MAJOR, SPDLOG_VER_MINOR, SPDLOG_VER_PATCH) + ", nlohmann-json " +
         dotted(NLOHMANN_JSON_VERSION_MAJOR, NLOHMANN_JSON_VERSION_MINOR, NLOHMANN_JSON_VERSION_PATCH);
}

}  // namespace zeropose
