#include "daemon/notify.h"

#include <systemd/sd-daemon.h>

#include <cstdint>

namespace zeropose {

void notify_ready(const std::string& status) { sd_notify(0, ("READY=1\nSTATUS=" + status).c_str()); }
void notify_status(const std::string& status) { sd_notify(0, ("STATUS=" + status).c_str()); }
void notify_alive() { sd_notify(0, "WATCHDOG=1"); }
void notify_stopping() { sd_notify(0, "STOPPING=1"); }

std::optional<std::chrono::milliseconds> watchdog_interval() {
  std::uint64_t period_us = 0;
  if (sd_watchdog_enabled(0, &period_us) <= 0) return std::nullopt;
  return std::chrono::milliseconds(period_us / 4000);
}

}  // namespace zeropose
