// GigE Vision cameras for a simulated cell: real devices on the network (GVCP and GVSP over UDP, Aravis' fake
// camera), with pixels from a callback.
#pragma once

#include <condition_variable>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <span>
#include <string>
#include <thread>
#include <vector>

namespace zeropose {

struct ServedCamera {
  std::string name;     // for messages
  std::string address;  // IPv4, must be on an interface of this machine
  int width_px = 0, height_px = 0;
  std::string serial = {};     // empty: ZP-ADDRESS
  std::string user_name = {};  // DeviceUserID, at most 15 characters
  std::string genicam = {};    // file that describes its features; empty: the library's own
};

// Cameras that expose when they are triggered by software. Every exposure shows a picture of its own, drawn
// ahead of it by one thread. Public calls may come from any thread.
class GigeServer {
 public:
  // Fills width * height grey levels of 0..255, whatever the pixel format: that has white at its own highest
  // value, and the same share of white. Called from one thread only, anew for
  // every frame.
  using Draw = std::function<void(std::size_t camera, std::span<std::uint8_t> pixels)>;

  // Throws std::runtime_error: an address is on no interface (says how to add it) or already served.
  GigeServer(std::vector<ServedCamera> cameras, Draw draw);
  ~GigeServer();
  GigeServer(const GigeServer&) = delete;
  GigeServer& operator=(const GigeServer&) = delete;

  // Pictures drawn before are thrown away: frames exposed from now on show what `draw` gives now.
  void picture_changed();

  // Faults. A stopped camera is gone from the network, also while it exposes or sends; 0.1 s.
  void stop_camera(std::size_t camera);
  void start_camera(std::size_t camera);  // throws std::runtime_error as the constructor
  bool running(std::size_t camera) const;
  void lose_packets(std::size_t camera, double ratio);          // 0..1 of the stream packets
  void send_narrower(std::size_t camera, int width_px);         // frames of another width from the next on
  void run_free(std::size_t camera, double frames_per_second);  // exposes unasked; 0: triggered again

  // Registers of the camera (ARV_FAKE_CAMERA_REGISTER_...); a stopped one reads 0.
  std::uint32_t read_register(std::size_t camera, std::uint32_t address) const;
  void write_register(std::size_t camera, std::uint32_t address, std::uint32_t value);

 private:
  struct Slot;

  void draw_pictures(const std::stop_token& stop);
  void wake_cameras(const std::stop_token& stop) const;
  void expose(Slot& slot, std::span<std::uint8_t> pixels);
  Slot* next_empty();

  const Draw draw_;
  mutable std::mutex mutex_;
  std::condition_variable_any changed_;
  std::uint64_t generation_ = 0;  // of the pictures
  std::vector<std::unique_ptr<Slot>> slots_;
  std::size_t last_drawn_ = 0;
  std::jthread drawer_, waker_;
};

}  // namespace zeropose
