// One opened GigE Vision device: the calls into Aravis, whose types stay in the .cpp file.
#pragma once

#include <memory>
#include <optional>
#include <string>

#include "drivers/camera.h"

namespace zeropose {

// What came out of the stream, whole or not.
struct ReceivedFrame {
  std::string problem;   // empty: the frame is whole
  std::uint64_t id = 0;  // as the camera counts: 16 bit, without zero, or 64 bit
  std::uint64_t device_time_ns = 0;
  TimePoint first_packet, last_packet;  // host, monotonic: when they were seen
  int width_px = 0, height_px = 0;
  std::uint32_t pixel_format = 0;                // PFNC
  std::size_t bytes = 0;                         // that came
  std::shared_ptr<const std::uint8_t> pixels;    // null: of another size or format than the options want
  std::optional<double> chunk_exposure_us = {};  // where the camera says it with the frame
};

struct GigeHealth {
  std::optional<double> temperature_c;
  std::string ptp_state;  // empty: no such clock, or not asked for
};

// All calls throw DeviceError and may block for seconds when the device is gone, unless they say otherwise.
class GigeDevice {
 public:
  // Finds the camera where the options give no address (1 s at most); opens it by address, without the
  // library's discovery and without its global lock; stops the acquisition at once, then applies the options
  // and reads them back.
  explicit GigeDevice(const CameraOptions& options);
  ~GigeDevice();
  GigeDevice(const GigeDevice&) = delete;
  GigeDevice& operator=(const GigeDevice&) = delete;

  void open_stream();            // a new UDP port, then starts the acquisition
  void close_stream() noexcept;  // stops the acquisition, lets what is under way run out, at most 0.3 s
  bool streaming() const;
  bool idle() const;  // no frame is queued and none is under way
  void trigger();
  // nullopt: deadline, or lost. Frames that are held keep their pixels when the stream or the device goes.
  std::optional<ReceivedFrame> receive(TimePoint deadline);
  // Asks the device whether it still knows us; throws when not, after 1 s at most.
  void require_control();
  bool lost() const;                    // it did not, or the library gave up its heartbeat; does not block
  double exposure_us() const;           // as read back
  double frame_period_us() const;       // likewise, when it runs freely
  GigeHealth health() const;            // asks the camera
  CameraStatistics statistics() const;  // the library's part
  std::string where() const;            // how messages begin

 private:
  struct Handles;
  std::unique_ptr<Handles> handles_;
};

}  // namespace zeropose
