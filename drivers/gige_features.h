// A camera's features by their standard names (SFNC 2.x): set from the options, read back and compared.
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "drivers/camera.h"
#include "drivers/gige_handles.h"

namespace zeropose {

// All calls throw DeviceError: a feature is missing although the cell file sets it, refuses its value or does
// not keep it.
class GigeFeatures {
 public:
  // Both must outlive this.
  GigeFeatures(_ArvCamera* camera, const CameraOptions& options) : camera_(camera), options_(options) {}

  // Format, size, light, trigger, PTP and chunks. The acquisition must be stopped.
  void configure();
  double exposure_us() const;      // as the camera says it
  double frame_period_us() const;  // likewise, when it runs freely
  bool chunks() const;             // it sends more than pixels
  // Not all cameras have a sensor for it.
  std::optional<double> temperature_c() const;
  // "Slave", "Master", ...; empty: it has no such clock, or the options do not ask for it.
  std::string ptp_state() const;

 private:
  bool has(const char* name) const;
  void need(const char* name, std::string_view key) const;
  void require(const GigeError& error, std::string_view doing) const;
  void require_set(double wanted, double got, std::string_view key) const;
  [[noreturn]] void fail(const std::string& what, DeviceFault fault = DeviceFault::missing) const;
  void set_word(const char* name, const char* word) const;
  void set_switch(const char* name, bool on) const;
  void set_number(const char* name, double value, std::string_view key) const;
  void set_format() const;
  void set_size() const;
  void set_light() const;
  void set_black_level() const;
  void set_gamma() const;
  void set_trigger() const;
  void set_free_run() const;
  void set_line_trigger() const;
  void set_ptp() const;
  void set_chunks() const;

  _ArvCamera* camera_;
  const CameraOptions& options_;
};

}  // namespace zeropose
