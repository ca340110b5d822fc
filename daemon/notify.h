// What the daemon tells systemd: ready, alive, stopping. Without systemd every call does nothing.
#pragma once

#include <chrono>
#include <optional>
#include <string>

namespace zeropose {

void notify_ready(const std::string& status);
void notify_status(const std::string& status);
void notify_alive();  // feeds the watchdog; call it only after progress was seen
void notify_stopping();

// How often the watchdog wants to be fed (half of WatchdogSec), nullopt when there is none.
std::optional<std::chrono::milliseconds> watchdog_interval();

}  // namespace zeropose
