#include "drivers/gige_features.h"

#include <arv.h>

#include <algorithm>
#include <cmath>

#include "drivers/gige_pixels.h"

namespace zeropose {
namespace {

std::string size_text(int width_px, int height_px) {
  return std::to_string(width_px) + "x" + std::to_string(height_px);
}

}  // namespace

void GigeFeatures::fail(const std::string& what, DeviceFault fault) const {
  throw DeviceError(title_of(options_) + ": " + what, fault);
}

void GigeFeatures::require(const GigeError& error, std::string_view doing) const {
  if (error)
    fail(std::string(doing) + " failed: " + error.text() +
         "; check its power, cable and address, and that no other program controls it");
}

// Cameras round to their own steps: within 2 % or half a unit counts as set.
void GigeFeatures::require_set(double wanted, double got, std::string_view key) const {
  const double step = std::abs(wanted) < 10 ? 0.05 : 0.5;
  if (std::abs(got - wanted) <= std::max(step, 0.02 * std::abs(wanted))) return;
  fail(std::string(key) + " " + std::to_string(wanted) + " was set, the camera says " + std::to_string(got) +
       "; choose a value within its range in the cell file");
}

bool GigeFeatures::has(const char* name) const {
  GigeError error;
  return arv_camera_is_feature_available(camera_, name, error.out()) && !error;
}

void GigeFeatures::need(const char* name, std::string_view key) const {
  if (!has(name))
    fail("has no feature " + std::string(name) + "; remove " + std::string(key) +
         " from the cell file or exchange the camera");
}

void GigeFeatures::set_word(const char* name, const char* word) const {
  const std::string doing = std::string("setting ") + name + " to " + word;
  GigeError error;
  arv_camera_set_string(camera_, name, word, error.out());
  require(error, doing);
  const char* got = arv_camera_get_string(camera_, name, error.out());
  require(error, std::string("reading ") + name + " back");
  if (std::string_view(got) != word) fail(doing + " had no effect, it says " + got);
}

void GigeFeatures::set_switch(const char* name, bool on) const {
  GigeError error;
  arv_camera_set_boolean(camera_, name, on, error.out());
  require(error, std::string("setting ") + name);
  const bool got = arv_camera_get_boolean(camera_, name, error.out()) != FALSE;
  require(error, std::string("reading ") + name + " back");
  if (got != on) fail(std::string("setting ") + name + " had no effect");
}

void GigeFeatures::set_number(const char* name, double value, std::string_view key) const {
  GigeError error;
  const bool whole = ARV_IS_GC_INTEGER(arv_device_get_feature(arv_camera_get_device(camera_), name)) &&
                     !ARV_IS_GC_FLOAT(arv_device_get_feature(arv_camera_get_device(camera_), name));
  if (whole)
    arv_camera_set_integer(camera_, name, std::lround(value), error.out());
  else
    arv_camera_set_float(camera_, name, value, error.out());
  require(error, std::string("setting ") + name + " to " + std::to_string(value));
  const double got = whole ? static_cast<double>(arv_camera_get_integer(camera_, name, error.out()))
                           : arv_camera_get_float(camera_, name, error.out());
  require(error, std::string("reading ") + name + " back");
  require_set(value, got, key);
}

void GigeFeatures::configure() {
  set_format();
  set_size();
  set_light();
  GigeError error;
  arv_camera_set_acquisition_mode(camera_, ARV_ACQUISITION_MODE_CONTINUOUS, error.out());
  require(error, "setting continuous acquisition");
  set_trigger();
  set_ptp();
  set_chunks();
}

void GigeFeatures::set_format() const {
  const GigePixels& pixels = gige_pixels(options_);
  GigeError error;
  arv_camera_set_pixel_format(camera_, pixels.code, error.out());
  const bool refused = static_cast<bool>(error);
  if (refused || arv_camera_get_pixel_format(camera_, error.out()) != pixels.code)
    fail(std::string("does not take pixel format ") + pixels.name +
             "; choose another pixel_format in the cell file or a monochrome camera that has it",
         DeviceFault::wrong_size);
}

void GigeFeatures::set_size() const {
  const std::string wanted =
      ", the cell file wants " + size_text(options_.width_px, options_.height_px) +
      (options_.x_px != 0 || options_.y_px != 0
           ? " at " + std::to_string(options_.x_px) + "," + std::to_string(options_.y_px)
           : "") +
      "; correct width_px and height_px there or exchange the camera";
  GigeError error;
  int sensor_width = 0, sensor_height = 0;
  arv_camera_get_sensor_size(camera_, &sensor_width, &sensor_height, error.out());
  require(error, "reading the sensor size");
  if (options_.x_px + options_.width_px > sensor_width || options_.y_px + options_.height_px > sensor_height)
    fail("its sensor has " + size_text(sensor_width, sensor_height) + wanted, DeviceFault::wrong_size);
  arv_camera_set_region(camera_, options_.x_px, options_.y_px, options_.width_px, options_.height_px,
                        error.out());
  require(error, "setting the image size");
  int x = 0, y = 0, width = 0, height = 0;
  arv_camera_get_region(camera_, &x, &y, &width, &height, error.out());
  require(error, "reading the image size back");
  if (width != options_.width_px || height != options_.height_px || x != options_.x_px || y != options_.y_px)
    fail("set itself to " + size_text(width, height) + " at " + std::to_string(x) + "," + std::to_string(y) +
             wanted,
         DeviceFault::wrong_size);
}

// What regulates itself would change a value that was set.
void GigeFeatures::set_light() const {
  GigeError error;
  if (options_.exposure_us) {
    if (has("ExposureAuto")) set_word("ExposureAuto", "Off");
    arv_camera_set_exposure_time(camera_, *options_.exposure_us, error.out());
    require(error, "setting the exposure");
    require_set(*options_.exposure_us, exposure_us(), "exposure_us");
  }
  if (options_.gain) {
    if (has("GainAuto")) set_word("GainAuto", "Off");
    arv_camera_set_gain(camera_, *options_.gain, error.out());
    require(error, "setting the gain");
    const double got = arv_camera_get_gain(camera_, error.out());
    require(error, "reading the gain back");
    require_set(*options_.gain, got, "gain");
  }
  if (options_.black_level) set_black_level();
  if (options_.gamma) set_gamma();
}

void GigeFeatures::set_black_level() const {
  const bool raw = !has("BlackLevel") && has("BlackLevelRaw");
  if (!raw) need("BlackLevel", "black_level");
  set_number(raw ? "BlackLevelRaw" : "BlackLevel", *options_.black_level, "black_level");
}

void GigeFeatures::set_gamma() const {
  need("Gamma", "gamma");
  if (has("GammaEnable")) set_switch("GammaEnable", true);
  set_number("Gamma", *options_.gamma, "gamma");
}

void GigeFeatures::set_trigger() const {
  GigeError error;
  switch (options_.trigger) {
    case TriggerSource::software:
      arv_camera_set_trigger(camera_, "Software", error.out());
      require(error, "setting the software trigger");
      return;
    case TriggerSource::line:
      return set_line_trigger();
    case TriggerSource::free_run:
      return set_free_run();
  }
}

void GigeFeatures::set_line_trigger() const {
  (void)exposure_us();  // or no frame could be told from an older one
  const char* line = options_.gige.trigger_line.c_str();
  GigeError error;
  if (!arv_camera_is_enumeration_entry_available(camera_, "TriggerSource", line, error.out()) || error)
    fail("has no trigger line " + options_.gige.trigger_line +
         "; correct trigger_line in the cell file, it is called as in the camera's TriggerSource");
  arv_camera_set_trigger(camera_, line, error.out());
  require(error, "setting the trigger to " + options_.gige.trigger_line);
  if (has("TriggerSelector")) set_word("TriggerSelector", "FrameStart");
  set_word("TriggerSource", line);
  set_word("TriggerMode", "On");
}

void GigeFeatures::set_free_run() const {
  (void)exposure_us();  // or no frame could be told from an older one
  GigeError error;
  if (!arv_camera_is_frame_rate_available(camera_, error.out()) || error)
    need("AcquisitionFrameRate", "trigger \"free_run\"");
  arv_camera_clear_triggers(camera_, error.out());
  require(error, "switching the trigger off");
  if (options_.frame_rate_hz) {
    arv_camera_set_frame_rate(camera_, *options_.frame_rate_hz, error.out());
    require(error, "setting the frame rate");
    require_set(*options_.frame_rate_hz, 1e6 / frame_period_us(), "frame_rate_hz");
  }
  if (has("TriggerSelector")) set_word("TriggerSelector", "FrameStart");
  if (has("TriggerMode")) set_word("TriggerMode", "Off");
}

void GigeFeatures::set_ptp() const {
  if (!options_.gige.ptp) return;
  const bool old_name = !has("PtpEnable") && has("GevIEEE1588");
  if (!old_name) need("PtpEnable", "network.ptp");
  set_switch(old_name ? "GevIEEE1588" : "PtpEnable", true);
}

// Useful where present: a camera that promises them and does not take them goes without.
void GigeFeatures::set_chunks() const {
  if (!has("ChunkModeActive") || !has("ChunkSelector") || !has("ChunkEnable")) return;
  GigeError error;
  arv_camera_set_chunk_mode(camera_, TRUE, error.out());
  for (const char* chunk : {"Timestamp", "ExposureTime"}) {
    if (error) break;
    if (arv_camera_is_enumeration_entry_available(camera_, "ChunkSelector", chunk, error.out()) && !error)
      arv_camera_set_chunk_state(camera_, chunk, TRUE, error.out());
  }
  if (error) arv_camera_set_chunk_mode(camera_, FALSE, error.out());
}

double GigeFeatures::exposure_us() const {
  GigeError error;
  const double exposure = arv_camera_get_exposure_time(camera_, error.out());
  require(error, "reading the exposure");
  return exposure;
}

double GigeFeatures::frame_period_us() const {
  GigeError error;
  const double rate_hz = arv_camera_get_frame_rate(camera_, error.out());
  require(error, "reading the frame rate");
  if (!(rate_hz > 0)) fail("says that it runs at " + std::to_string(rate_hz) + " Hz; set frame_rate_hz");
  return 1e6 / rate_hz;
}

bool GigeFeatures::chunks() const {
  GigeError error;
  return has("ChunkModeActive") && arv_camera_get_chunk_mode(camera_, error.out()) && !error;
}

std::optional<double> GigeFeatures::temperature_c() const {
  if (!has("DeviceTemperature")) return std::nullopt;
  GigeError error;
  const double temperature = arv_camera_get_float(camera_, "DeviceTemperature", error.out());
  if (error) return std::nullopt;
  return temperature;
}

std::string GigeFeatures::ptp_state() const {
  if (!options_.gige.ptp) return {};
  GigeError error;
  if (has("PtpDataSetLatch")) arv_camera_execute_command(camera_, "PtpDataSetLatch", error.out());
  for (const char* name : {"PtpStatus", "GevIEEE1588Status"}) {
    if (!has(name)) continue;
    const char* state = arv_camera_get_string(camera_, name, error.out());
    return error || state == nullptr ? "" : state;
  }
  return {};
}

}  // namespace zeropose
