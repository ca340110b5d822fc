// The V4L2 capture devices of this computer, for the engineer who chooses one.
#pragma once

#include <string>
#include <vector>

namespace zeropose {

struct FoundV4l2Camera {
  std::string device;  // /dev/videoN; may be another one after the next start
  std::string card, driver, bus;
  // /dev/v4l/by-path/... says where it is plugged in, /dev/v4l/by-id/... which one it is; both are empty
  // without udev.
  std::string by_path, by_id;
};

// In the order of their numbers. Devices that may not be opened are left out.
std::vector<FoundV4l2Camera> discover_v4l2();

}  // namespace zeropose
