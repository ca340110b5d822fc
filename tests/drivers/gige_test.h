// What the tests of GigE cameras have in common.
#pragma once

#include <gtest/gtest.h>

#include <chrono>
#include <optional>
#include <string>
#include <utility>

#include "drivers/camera.h"

namespace zeropose {

inline TimePoint in(std::chrono::milliseconds time) { return std::chrono::steady_clock::now() + time; }

inline std::optional<Frame> triggered_frame(Camera& camera) {
  camera.trigger();
  return camera.grab(in(std::chrono::seconds(3)));
}

// The fault and the message of a call that must fail.
template <class Call>
std::pair<DeviceFault, std::string> failure(Call call) {
  try {
    call();
  } catch (const DeviceError& error) {
    return {error.fault(), error.what()};
  }
  ADD_FAILURE() << "no DeviceError";
  return {};
}

}  // namespace zeropose
