#include "drivers/v4l2_controls.h"

#include <linux/videodev2.h>

#include <algorithm>
#include <bit>
#include <cctype>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <optional>
#include <string_view>
#include <vector>

namespace zeropose {
namespace {

constexpr double exposure_step_us = 100;  // of V4L2_CID_EXPOSURE_ABSOLUTE

std::string plain(std::string_view name) {
  std::string letters;
  for (const char letter : name)
    if (std::isalnum(static_cast<unsigned char>(letter)) != 0)
      letters += static_cast<char>(std::tolower(static_cast<unsigned char>(letter)));
  return letters;
}

class Controls {
 public:
  explicit Controls(const V4l2Handle& handle) : handle_(handle) {
    v4l2_queryctrl control{};
    control.id = V4L2_CTRL_FLAG_NEXT_CTRL;
    for (; handle.call(VIDIOC_QUERYCTRL, &control) == 0; control.id |= V4L2_CTRL_FLAG_NEXT_CTRL)
      if (control.type != V4L2_CTRL_TYPE_CTRL_CLASS && (control.flags & V4L2_CTRL_FLAG_DISABLED) == 0)
        controls_.push_back(control);
  }

  const v4l2_queryctrl* find(std::uint32_t id) const {
    const auto found = std::ranges::find(controls_, id, &v4l2_queryctrl::id);
    return found == controls_.end() ? nullptr : &*found;
  }

  const v4l2_queryctrl& find(const std::string& name) const {
    const auto found = std::ranges::find_if(
        controls_, [&](const v4l2_queryctrl& control) { return plain(name_of(control)) == plain(name); });
    if (found != controls_.end()) return *found;
    handle_.fail("has no control '" + name + "'; v4l2-ctl --list-ctrls shows those that it has");
  }

  void set(const v4l2_queryctrl& control, int value) const {
    const std::string name = name_of(control);
    v4l2_control call{control.id, value};
    const int error = handle_.call(VIDIOC_S_CTRL, &call);
    if (error == ENODEV) handle_.require(error, "");
    if (error != 0)
      handle_.fail("does not take " + std::to_string(value) + " for control '" + name + "' (" +
                   std::strerror(error) + "); it takes " + range_of(control));
    if (control.type == V4L2_CTRL_TYPE_BUTTON || (control.flags & V4L2_CTRL_FLAG_WRITE_ONLY) != 0) return;
    handle_.require(handle_.call(VIDIOC_G_CTRL, &call), "reading control '" + name + "' back");
    if (call.value != value)
      handle_.fail("control '" + name + "' was set to " + std::to_string(value) + ", the device says " +
                   std::to_string(call.value) + "; it takes " + range_of(control));
  }

 private:
  static std::string name_of(const v4l2_queryctrl& control) {
    return std::bit_cast<const char*>(&control.name[0]);
  }
  static std::string range_of(const v4l2_queryctrl& control) {
    return std::to_string(control.minimum) + " to " + std::to_string(control.maximum) +
           (control.step > 1 ? " in steps of " + std::to_string(control.step) : "");
  }

  const V4l2Handle& handle_;
  std::vector<v4l2_queryctrl> controls_;
};

// The first of `ids` that the device has takes the option; without any the key must go.
void set_option(const Controls& controls, const V4l2Handle& handle, std::string_view key,
                const std::vector<std::uint32_t>& ids, std::optional<double> value) {
  if (!value) return;
  for (const std::uint32_t id : ids)
    if (const v4l2_queryctrl* control = controls.find(id)) {
      controls.set(*control, static_cast<int>(std::lround(*value)));
      return;
    }
  handle.fail("has no control for it; remove " + std::string(key) +
              " from the cell file, or set one of those that v4l2-ctl --list-ctrls shows under controls");
}

void set_exposure(const Controls& controls, const V4l2Handle& handle, std::optional<double> exposure_us) {
  if (!exposure_us) return;
  if (const v4l2_queryctrl* automatic = controls.find(V4L2_CID_EXPOSURE_AUTO))
    controls.set(*automatic, V4L2_EXPOSURE_MANUAL);
  set_option(controls, handle, "exposure_us", {V4L2_CID_EXPOSURE_ABSOLUTE}, *exposure_us / exposure_step_us);
}

void set_gain(const Controls& controls, const V4l2Handle& handle, std::optional<double> gain) {
  const v4l2_queryctrl* automatic = controls.find(V4L2_CID_AUTOGAIN);
  if (gain && automatic != nullptr) controls.set(*automatic, 0);
  set_option(controls, handle, "gain", {V4L2_CID_GAIN, V4L2_CID_ANALOGUE_GAIN}, gain);
}

}  // namespace

void set_v4l2_controls(const V4l2Handle& handle, const CameraOptions& options) {
  const Controls controls(handle);
  set_exposure(controls, handle, options.exposure_us);
  set_gain(controls, handle, options.gain);
  set_option(controls, handle, "black_level", {V4L2_CID_BLACK_LEVEL}, options.black_level);
  set_option(controls, handle, "gamma", {V4L2_CID_GAMMA}, options.gamma);
  for (const V4l2Control& control : options.v4l2.controls)
    controls.set(controls.find(control.name), control.value);
}

}  // namespace zeropose
