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
  int width_px = 0, height_px = 0;
  bool mono8 = false;
  std::vector<std::uint8_t> pixels;
};

// All calls throw DeviceError and may block for seconds when the device is gone, unless they say otherwise.
class GigeDevice {
 public:
  // Opens by address, without discovery and without the library's global lock; stops the acquisition at once,
  // then applies the options and reads them back.
  explicit GigeDevice(const CameraOptions& options);
  ~GigeDevice();
  GigeDevice(const GigeDevice&) = delete;
  GigeDevice& operator=(const GigeDevice&) = delete;

  void open_stream();            // a new UDP port, then starts the acquisition
  void close_stream() noexcept;  // stops the acquisition, lets what is under way run out, at most 0.3 s
  bool streaming() const;
  bool idle() const;  // no frame is queued and none is under way
  void trigger();
  std::optional<ReceivedFrame> receive(TimePoint deadline);  // nullopt: deadline, or lost
  // Asks the device whether it still knows us; throws when not, after 1 s at most.
  void require_control();
  bool lost() const;                    // it did not, or the library gave up its heartbeat; does not block
  CameraStatistics statistics() const;  // the library's part
  std::string where() const;            // how messages begin

 private:
  struct Handles;
  std::unique_ptr<Handles> handles_;
};

}  // namespace zeropose
