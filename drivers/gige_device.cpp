#include "drivers/gige_device.h"

#include <arv.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <mutex>
#include <string_view>
#include <thread>

#include "drivers/gige_network.h"

namespace zeropose {
namespace {

using std::chrono::microseconds;
using std::chrono::milliseconds;
using std::chrono::steady_clock;

constexpr int stream_buffers = 4;
constexpr int socket_buffer_bytes = 4 << 20;
constexpr int untested_packet_bytes = 1500;
constexpr milliseconds quiet_step{10};
constexpr int quiet_steps_at_most = 30;
// GigE Vision 2.0, bootstrap registers: the version; who controls the device, neither bit set: nobody.
constexpr std::uint32_t version_register = 0x0000;
constexpr std::uint32_t control_privilege_register = 0x0a00;
constexpr std::uint32_t control_privilege_bits = 0x3;
constexpr milliseconds sign_of_life{1000};

struct Unref {
  void operator()(gpointer object) const { g_object_unref(object); }
};
template <class T>
using Owner = std::unique_ptr<T, Unref>;

class Error {
 public:
  Error() = default;
  ~Error() { g_clear_error(&error_); }
  Error(const Error&) = delete;
  Error& operator=(const Error&) = delete;
  GError** out() { return &error_; }
  explicit operator bool() const { return error_ != nullptr; }
  std::string text() const { return error_->message; }

 private:
  GError* error_ = nullptr;
};

std::string problem_of(ArvBuffer* buffer) {
  switch (arv_buffer_get_status(buffer)) {
    case ARV_BUFFER_STATUS_SUCCESS:
      return arv_buffer_get_payload_type(buffer) == ARV_BUFFER_PAYLOAD_TYPE_IMAGE ? "" : "it is no image";
    case ARV_BUFFER_STATUS_TIMEOUT:
      return "packets are missing, the rest never came";
    case ARV_BUFFER_STATUS_MISSING_PACKETS:
      return "packets are missing";
    case ARV_BUFFER_STATUS_WRONG_PACKET_ID:
      return "a packet has a wrong number";
    case ARV_BUFFER_STATUS_SIZE_MISMATCH:
      return "it is larger than agreed";
    case ARV_BUFFER_STATUS_ABORTED:
      return "the transfer was broken off";
    default:
      return "the library did not complete it (status " + std::to_string(arv_buffer_get_status(buffer)) + ")";
  }
}

ReceivedFrame copy_of(ArvBuffer* buffer) {
  ReceivedFrame frame;
  frame.problem = problem_of(buffer);
  frame.id = arv_buffer_get_frame_id(buffer);
  if (!frame.problem.empty()) return frame;
  frame.device_time_ns = arv_buffer_get_timestamp(buffer);
  frame.width_px = arv_buffer_get_image_width(buffer);
  frame.height_px = arv_buffer_get_image_height(buffer);
  frame.mono8 = arv_buffer_get_image_pixel_format(buffer) == ARV_PIXEL_FORMAT_MONO_8;
  std::size_t bytes = 0;
  const auto* data = static_cast<const std::uint8_t*>(arv_buffer_get_data(buffer, &bytes));
  frame.pixels.assign(data, data + bytes);
  return frame;
}

std::uint64_t count(ArvStream* stream, const char* name) {
  return arv_stream_get_info_uint64_by_name(stream, name);
}

std::string size_text(int width_px, int height_px) {
  return std::to_string(width_px) + "x" + std::to_string(height_px);
}

}  // namespace

// Owns the library's objects; destroyed in reverse order: stream, camera, device.
struct GigeDevice::Handles {
  explicit Handles(const CameraOptions& camera_options) : options(camera_options) {}

  void require(const Error& error, std::string_view doing) const;
  [[noreturn]] void fail(const std::string& what, DeviceFault fault = DeviceFault::missing) const;
  [[noreturn]] void fail_in_use() const {
    fail("another program controls it; stop that program. After a crash it is free in 3 s",
         DeviceFault::in_use);
  }
  void open(const NetworkInterface& interface);
  void configure();
  void set_size();
  void set_light();
  void require_set(double wanted, double got, std::string_view what) const;
  void set_packet_size(const NetworkInterface& interface);
  int tested_packet_bytes(const NetworkInterface& interface);
  bool lost() const;
  void notice_silence() noexcept;
  void wait_until_quiet();

  CameraOptions options;
  bool found_lost = false;  // by our own questions
  Owner<ArvDevice> device;
  Owner<ArvCamera> camera;
  Owner<ArvStream> stream;
  CameraStatistics closed_streams;
};

void GigeDevice::Handles::fail(const std::string& what, DeviceFault fault) const {
  throw DeviceError(title_of(options) + ": " + what, fault);
}

void GigeDevice::Handles::require(const Error& error, std::string_view doing) const {
  if (error)
    fail(std::string(doing) + " failed: " + error.text() +
         "; check its power, cable and address, and that no other program controls it");
}

void GigeDevice::Handles::open(const NetworkInterface& interface) {
  const Owner<GInetAddress> here(g_inet_address_new_from_string(interface.address.c_str()));
  const Owner<GInetAddress> there(g_inet_address_new_from_string(options.gige.address.c_str()));
  Error error;
  device.reset(arv_gv_device_new(here.get(), there.get(), error.out()));
  require(error, "opening");
  if (!arv_gv_device_is_controller(ARV_GV_DEVICE(device.get()))) fail_in_use();
  camera.reset(arv_camera_new_with_device(device.get(), error.out()));
  require(error, "reading its features");
  // A camera that was streaming to somebody else would send one bad frame and then nothing.
  arv_camera_stop_acquisition(camera.get(), error.out());
  require(error, "stopping the acquisition");
}

void GigeDevice::Handles::configure() {
  Error error;
  arv_camera_set_pixel_format(camera.get(), ARV_PIXEL_FORMAT_MONO_8, error.out());
  require(error, "setting pixel format Mono8");
  if (arv_camera_get_pixel_format(camera.get(), error.out()) != ARV_PIXEL_FORMAT_MONO_8)
    fail("does not take pixel format Mono8; choose a monochrome camera", DeviceFault::wrong_size);
  set_size();
  set_light();
  arv_camera_set_acquisition_mode(camera.get(), ARV_ACQUISITION_MODE_CONTINUOUS, error.out());
  require(error, "setting continuous acquisition");
  arv_camera_set_trigger(camera.get(), "Software", error.out());
  require(error, "setting the software trigger");
}

void GigeDevice::Handles::set_size() {
  const std::string wanted = ", the cell file wants " + size_text(options.width_px, options.height_px) +
                             "; correct width_px and height_px there or exchange the camera";
  Error error;
  int sensor_width = 0, sensor_height = 0;
  arv_camera_get_sensor_size(camera.get(), &sensor_width, &sensor_height, error.out());
  require(error, "reading the sensor size");
  if (options.width_px > sensor_width || options.height_px > sensor_height)
    fail("its sensor has " + size_text(sensor_width, sensor_height) + wanted, DeviceFault::wrong_size);
  arv_camera_set_region(camera.get(), 0, 0, options.width_px, options.height_px, error.out());
  require(error, "setting the image size");
  int x = 0, y = 0, width = 0, height = 0;
  arv_camera_get_region(camera.get(), &x, &y, &width, &height, error.out());
  require(error, "reading the image size back");
  if (width != options.width_px || height != options.height_px || x != 0 || y != 0)
    fail("set itself to " + size_text(width, height) + " at " + std::to_string(x) + "," + std::to_string(y) +
             wanted,
         DeviceFault::wrong_size);
}

void GigeDevice::Handles::set_light() {
  Error error;
  if (options.exposure_us) {
    arv_camera_set_exposure_time(camera.get(), *options.exposure_us, error.out());
    require(error, "setting the exposure");
    const double got = arv_camera_get_exposure_time(camera.get(), error.out());
    require(error, "reading the exposure back");
    require_set(*options.exposure_us, got, "exposure_us");
  }
  if (options.gain) {
    arv_camera_set_gain(camera.get(), *options.gain, error.out());
    require(error, "setting the gain");
    const double got = arv_camera_get_gain(camera.get(), error.out());
    require(error, "reading the gain back");
    require_set(*options.gain, got, "gain");
  }
}

// Cameras round to their own steps: within 2 % or half a unit counts as set.
void GigeDevice::Handles::require_set(double wanted, double got, std::string_view what) const {
  if (std::abs(got - wanted) <= std::max(0.5, 0.02 * std::abs(wanted))) return;
  fail(std::string(what) + " " + std::to_string(wanted) + " was set, the camera says " + std::to_string(got) +
       "; choose a value within its range in the cell file");
}

// Between hosts only a test shows what the switches let through.
int GigeDevice::Handles::tested_packet_bytes(const NetworkInterface& interface) {
  const int largest = largest_packet_bytes(interface);
  if (interface.loopback) return largest;
  const int safe = std::min(largest, untested_packet_bytes);
  Error error;
  arv_gv_device_set_packet_size(ARV_GV_DEVICE(device.get()), safe, error.out());
  require(error, "setting the packet size");
  const auto tested =
      static_cast<int>(arv_gv_device_auto_packet_size(ARV_GV_DEVICE(device.get()), error.out()));
  return error ? safe : std::min(tested, largest);
}

void GigeDevice::Handles::set_packet_size(const NetworkInterface& interface) {
  ArvGvDevice* gv_device = ARV_GV_DEVICE(device.get());
  arv_gv_device_set_packet_size_adjustment(gv_device, ARV_GV_PACKET_SIZE_ADJUSTMENT_NEVER);
  // The library prefers a packet socket where it is allowed. It hands over its packets up to 5 ms late, and
  // wrong pixels as a whole frame when a packet is above the MTU. So only where a plain UDP socket would lose
  // packets for want of a buffer.
  if (receive_buffer_allowed(socket_buffer_bytes))
    arv_gv_device_set_stream_options(gv_device, ARV_GV_STREAM_OPTION_PACKET_SOCKET_DISABLED);
  Error error;
  arv_gv_device_set_packet_size(gv_device, tested_packet_bytes(interface), error.out());
  require(error, "setting the packet size");
  const auto got = static_cast<int>(arv_gv_device_get_packet_size(gv_device, error.out()));
  require(error, "reading the packet size back");
  if (got > interface.mtu_bytes)
    fail("insists on packets of " + std::to_string(got) + " bytes, interface " + interface.name + " takes " +
         std::to_string(interface.mtu_bytes) + "; raise its MTU");
}

// Never connect a handler to the device's signal "control-lost". arv_gv_device_heartbeat_thread emits it
// without holding a reference, and arv_gv_device_finalize waits for that thread: it may emit while the last
// reference goes, most likely when we notice the same loss. With a handler connected g_signal_emit takes a
// reference of its own: too late, and the object is already being finalized (g_object_ref fails, the emission
// goes on with a null instance: SIGSEGV), or it is the last one, and the thread finalizes the device and
// joins itself (abort). To disconnect first does not help: an emission that has begun goes on. Without a
// handler, and without one of the class (ArvDeviceClass::control_lost is null), g_signal_emit_valist returns
// before it touches the reference count, and the memory is there until finalize has joined the thread. So the
// loss is asked for instead: after its emission the thread makes arv_gv_device_is_controller false, and
// reading that takes no lock.
bool GigeDevice::Handles::lost() const {
  return found_lost || !arv_gv_device_is_controller(ARV_GV_DEVICE(device.get()));
}

// Saves the seconds that a command to a device costs that is gone.
void GigeDevice::Handles::notice_silence() noexcept {
  try {
    if (!lost() && !read_register(options.gige.address, version_register, sign_of_life)) found_lost = true;
  } catch (const DeviceError&) {
    found_lost = true;
  }
}

// Lets a frame that the camera was still sending run into the old stream.
void GigeDevice::Handles::wait_until_quiet() {
  std::uint64_t before = count(stream.get(), "n_received_packets");
  for (int step = 0; step < quiet_steps_at_most; ++step) {
    std::this_thread::sleep_for(quiet_step);
    const std::uint64_t now = count(stream.get(), "n_received_packets");
    if (now == before) return;
    before = now;
  }
}

GigeDevice::GigeDevice(const CameraOptions& options) : handles_(std::make_unique<Handles>(options)) {
  if (!read_register(options.gige.address, version_register, sign_of_life))
    handles_->fail("does not answer; check its power, cable and address");
  // Reading this register renews the controller's claim in some devices: not more often than a heartbeat.
  const auto privilege = read_register(options.gige.address, control_privilege_register, sign_of_life);
  if ((privilege.value_or(0) & control_privilege_bits) != 0) handles_->fail_in_use();
  NetworkInterface interface;
  {
    // The library reads a device's description with shared state and no lock: two at a time break it. Only
    // devices that just answered come here, so that none waits for a dead one.
    static std::mutex one_at_a_time;
    const std::lock_guard lock(one_at_a_time);
    // As late as possible: arv_gv_device_finalize dereferences null when arv_gv_device_constructed could not
    // bind to the interface's address, because it went away.
    interface = interface_towards(options.gige.address);
    handles_->open(interface);
  }
  handles_->configure();
  handles_->set_packet_size(interface);
}

GigeDevice::~GigeDevice() { close_stream(); }

void GigeDevice::open_stream() {
  Handles& own = *handles_;
  Error error;
  Owner<ArvStream> stream(arv_camera_create_stream(own.camera.get(), nullptr, nullptr, error.out()));
  own.require(error, "creating the stream");
  g_object_set(stream.get(), "socket-buffer", ARV_GV_STREAM_SOCKET_BUFFER_FIXED, "socket-buffer-size",
               socket_buffer_bytes, nullptr);
  const unsigned payload_bytes = arv_camera_get_payload(own.camera.get(), error.out());
  own.require(error, "reading the payload size");
  for (int i = 0; i < stream_buffers; ++i)
    arv_stream_push_buffer(stream.get(), arv_buffer_new(payload_bytes, nullptr));
  arv_camera_start_acquisition(own.camera.get(), error.out());
  own.require(error, "starting the acquisition");
  own.stream = std::move(stream);
}

void GigeDevice::close_stream() noexcept {
  Handles& own = *handles_;
  if (!own.stream) return;
  Error error;
  own.notice_silence();
  if (!own.lost()) arv_camera_stop_acquisition(own.camera.get(), error.out());
  if (!own.lost() && !error) own.wait_until_quiet();
  own.closed_streams = statistics();
  own.stream.reset();
}

bool GigeDevice::streaming() const { return handles_->stream != nullptr; }

bool GigeDevice::idle() const {
  int waiting = 0, done = 0;
  arv_stream_get_n_buffers(handles_->stream.get(), &waiting, &done);
  return done == 0 && waiting == stream_buffers;
}

void GigeDevice::trigger() {
  Error error;
  arv_camera_software_trigger(handles_->camera.get(), error.out());
  handles_->require(error, "triggering");
}

std::optional<ReceivedFrame> GigeDevice::receive(TimePoint deadline) {
  constexpr microseconds slice{100'000};  // between looks at the heartbeat
  ArvStream* stream = handles_->stream.get();
  while (!handles_->lost()) {
    const auto left = std::chrono::duration_cast<microseconds>(deadline - steady_clock::now());
    const auto wait = std::clamp(left, microseconds{0}, slice);
    ArvBuffer* buffer = arv_stream_timeout_pop_buffer(stream, static_cast<guint64>(wait.count()));
    if (buffer != nullptr) {
      ReceivedFrame frame = copy_of(buffer);
      arv_stream_push_buffer(stream, buffer);
      return frame;
    }
    if (left <= slice) return std::nullopt;
  }
  return std::nullopt;
}

void GigeDevice::require_control() {
  const auto privilege =
      read_register(handles_->options.gige.address, control_privilege_register, sign_of_life);
  if (privilege && (*privilege & control_privilege_bits) != 0) return;
  handles_->found_lost = true;
  if (!privilege) handles_->fail("does not answer; check its power and cable. It is used again when it does");
  handles_->fail("no longer knows us, so it was switched off in between; it is opened again");
}

bool GigeDevice::lost() const { return handles_->lost(); }

CameraStatistics GigeDevice::statistics() const {
  CameraStatistics current;
  if (ArvStream* stream = handles_->stream.get()) {
    current.failures = count(stream, "n_failures");
    current.underruns = count(stream, "n_underruns");
    current.resent_packets = count(stream, "n_resent_packets");
    current.missing_packets = count(stream, "n_missing_packets");
  }
  return handles_->closed_streams + current;
}

std::string GigeDevice::where() const { return title_of(handles_->options); }

}  // namespace zeropose
