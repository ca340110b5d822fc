// Which GigE Vision cameras are there: asked by a broadcast on each network interface, without the library
// and without its global lock.
#pragma once

#include <chrono>
#include <functional>
#include <optional>
#include <string>
#include <vector>

namespace zeropose {

// As the camera says it. An address outside of the interface's network cannot be reached from here.
struct FoundGigeCamera {
  std::string vendor, model, serial, user_name, address, mac, interface;
};

// All that answer in the time, on all interfaces that are up or on one; each once per interface, sorted by
// address. Takes the whole time. Throws DeviceError: there is no such interface.
std::vector<FoundGigeCamera> discover_gige(std::chrono::milliseconds within,
                                           const std::string& only_interface = {});

// The first that answers and is wanted; returns as soon as it does. nullopt: none did in the time.
std::optional<FoundGigeCamera> find_gige(std::chrono::milliseconds within, const std::string& only_interface,
                                         const std::function<bool(const FoundGigeCamera&)>& wanted);

}  // namespace zeropose
