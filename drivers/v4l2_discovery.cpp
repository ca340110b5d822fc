#include "drivers/v4l2_discovery.h"

#include <linux/videodev2.h>

#include <algorithm>
#include <filesystem>
#include <optional>
#include <system_error>

#include "drivers/v4l2_handle.h"

namespace zeropose {
namespace {

namespace fs = std::filesystem;

template <std::size_t Size>
std::string text_of(const std::uint8_t (&bytes)[Size]) {
  const auto* end = std::find(bytes, bytes + Size, 0);
  return {bytes, end};
}

// The link in a folder of links that leads to the device; empty: none.
std::string link_to(const fs::path& device, const char* folder) {
  std::error_code none;
  for (fs::directory_iterator entry(folder, none), end; !none && entry != end; entry.increment(none)) {
    std::error_code dead;
    if (fs::canonical(entry->path(), dead) == device) return entry->path().string();
  }
  return {};
}

std::optional<FoundV4l2Camera> look_at(const fs::path& device) {
  const V4l2Handle handle(device.string());
  v4l2_capability capability{};
  if (!handle.is_open() || handle.call(VIDIOC_QUERYCAP, &capability) != 0) return std::nullopt;
  const bool own = (capability.capabilities & V4L2_CAP_DEVICE_CAPS) != 0;
  const auto can = own ? capability.device_caps : capability.capabilities;
  if ((can & (V4L2_CAP_VIDEO_CAPTURE | V4L2_CAP_VIDEO_CAPTURE_MPLANE)) == 0) return std::nullopt;
  return FoundV4l2Camera{device.string(),
                         text_of(capability.card),
                         text_of(capability.driver),
                         text_of(capability.bus_info),
                         link_to(device, "/dev/v4l/by-path"),
                         link_to(device, "/dev/v4l/by-id")};
}

}  // namespace

std::vector<FoundV4l2Camera> discover_v4l2() {
  std::vector<std::pair<std::size_t, fs::path>> devices;  // videoN: shorter names have smaller numbers
  std::error_code none;
  for (fs::directory_iterator entry("/dev", none), end; !none && entry != end; entry.increment(none)) {
    const std::string name = entry->path().filename().string();
    if (name.starts_with("video")) devices.emplace_back(name.size(), entry->path());
  }
  std::ranges::sort(devices);
  std::vector<FoundV4l2Camera> found;
  for (const auto& [length, device] : devices)
    if (auto camera = look_at(device)) found.push_back(std::move(*camera));
  return found;
}

}  // namespace zeropose
