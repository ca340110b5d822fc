#include "drivers/gige_device.h"

#include <arv.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cstring>
#include <mutex>
#include <string_view>
#include <thread>

#include "drivers/gige_buffers.h"
#include "drivers/gige_discovery.h"
#include "drivers/gige_features.h"
#include "drivers/gige_network.h"
#include "drivers/gige_packets.h"
#include "drivers/gige_pixels.h"

namespace zeropose {
namespace {

using std::chrono::milliseconds;
using std::chrono::steady_clock;

// A camera that is triggered sends one frame at a time; of one that runs freely only the latest are of use.
constexpr GigeBufferRules triggered_buffers{};
constexpr GigeBufferRules running_buffers{.count = 8, .kept = 4, .queued = 2};
constexpr milliseconds quiet_step{10};
constexpr int quiet_steps_at_most = 30;
// GigE Vision 2.0, bootstrap registers: the version; who controls the device, neither bit set: nobody.
constexpr std::uint32_t version_register = 0x0000;
constexpr std::uint32_t control_privilege_register = 0x0a00;
constexpr std::uint32_t control_privilege_bits = 0x3;
constexpr std::uint32_t serial_register = 0x00d8, user_name_register = 0x00e8;
constexpr std::size_t name_bytes = 16;
constexpr milliseconds sign_of_life{1000};
constexpr milliseconds discovery{1000};

// The library reads a device's description with shared state and no lock: two at a time break it. Only for
// devices that just answered, so that none waits for a dead one.
std::mutex reads_description;

std::string problem_of(ArvBuffer* buffer) {
  const ArvBufferPayloadType payload = arv_buffer_get_payload_type(buffer);
  switch (arv_buffer_get_status(buffer)) {
    case ARV_BUFFER_STATUS_SUCCESS:
      return payload == ARV_BUFFER_PAYLOAD_TYPE_IMAGE ||
                     payload == ARV_BUFFER_PAYLOAD_TYPE_EXTENDED_CHUNK_DATA
                 ? ""
                 : "it is no image";
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

// Comes from the library's thread.
void on_stream(void* buffers, ArvStreamCallbackType what, ArvBuffer*) {
  if (what == ARV_STREAM_CALLBACK_TYPE_START_BUFFER) static_cast<GigeBuffers*>(buffers)->started();
  if (what == ARV_STREAM_CALLBACK_TYPE_BUFFER_DONE) static_cast<GigeBuffers*>(buffers)->done();
}

std::uint64_t count(ArvStream* stream, const char* name) {
  return arv_stream_get_info_uint64_by_name(stream, name);
}

}  // namespace

// Owns the library's objects; destroyed in reverse order: stream, camera, device.
struct GigeDevice::Handles {
  explicit Handles(const CameraOptions& camera_options) : options(camera_options) {}

  void require(const GigeError& error, std::string_view doing) const;
  [[noreturn]] void fail(const std::string& what, DeviceFault fault = DeviceFault::missing) const;
  [[noreturn]] void fail_in_use() const {
    fail("another program controls it; stop that program. After a crash it is free in 3 s",
         DeviceFault::in_use);
  }
  void open(const NetworkInterface& interface);
  void find();
  void require_same_camera();
  std::string name_at(std::uint32_t address) const;
  void require_named(std::string_view what, const std::string& wanted, const std::string& got) const;
  ReceivedFrame frame_of(GigeBuffers::Full full);
  std::optional<double> chunk_exposure_us(ArvBuffer* buffer) const;
  bool lost() const;
  void notice_silence() noexcept;
  void wait_until_quiet();
  void drop_stream() noexcept;

  bool running() const { return options.trigger != TriggerSource::software; }
  GigeFeatures features() const { return {camera.get(), options}; }

  CameraOptions options;
  bool found_lost = false;  // by our own questions
  GigeOwner<ArvDevice> device;
  GigeOwner<ArvCamera> camera;
  GigeOwner<ArvChunkParser> chunks;
  std::shared_ptr<GigeBuffers> buffers;  // of the stream; before it, as the library calls it to its end
  GigeOwner<ArvStream> stream;
  CameraStatistics closed_streams;
};

void GigeDevice::Handles::fail(const std::string& what, DeviceFault fault) const {
  throw DeviceError(title_of(options) + ": " + what, fault);
}

void GigeDevice::Handles::require(const GigeError& error, std::string_view doing) const {
  if (error)
    fail(std::string(doing) + " failed: " + error.text() +
         "; check its power, cable and address, and that no other program controls it");
}

void GigeDevice::Handles::open(const NetworkInterface& interface) {
  const GigeOwner<GInetAddress> here(g_inet_address_new_from_string(interface.address.c_str()));
  const GigeOwner<GInetAddress> there(g_inet_address_new_from_string(options.gige.address.c_str()));
  GigeError error;
  device.reset(arv_gv_device_new(here.get(), there.get(), error.out()));
  require(error, "opening");
  if (!arv_gv_device_is_controller(ARV_GV_DEVICE(device.get()))) fail_in_use();
  camera.reset(arv_camera_new_with_device(device.get(), error.out()));
  require(error, "reading its features");
  // A camera that was streaming to somebody else would send one bad frame and then nothing.
  arv_camera_stop_acquisition(camera.get(), error.out());
  require(error, "stopping the acquisition");
}

// By serial number or name, in the order in which cameras answer.
void GigeDevice::Handles::find() {
  GigeOptions& gige = options.gige;
  if (!gige.address.empty()) return;
  const auto found = find_gige(discovery, gige.interface, [&gige](const FoundGigeCamera& answer) {
    return (gige.serial.empty() || answer.serial == gige.serial) &&
           (gige.user_name.empty() || answer.user_name == gige.user_name);
  });
  if (!found)
    fail("no such camera answers" + (gige.interface.empty() ? "" : " on interface " + gige.interface) +
         "; check its power and cable and what the cell file calls it: `zeropose cameras list` shows those "
         "that answer");
  gige.address = found->address;
}

std::string GigeDevice::Handles::name_at(std::uint32_t address) const {
  std::array<char, name_bytes + 1> text{};
  GigeError error;
  arv_device_read_memory(device.get(), address, name_bytes, text.data(), error.out());
  require(error, "reading its names");
  return text.data();
}

void GigeDevice::Handles::require_named(std::string_view what, const std::string& wanted,
                                        const std::string& got) const {
  if (!wanted.empty() && wanted != got)
    fail("the camera with this address has the " + std::string(what) + " \"" + got +
         "\", the cell file wants \"" + wanted +
         "\"; perhaps two cameras swapped their addresses: give each its own again, or correct the "
         "cell file");
}

void GigeDevice::Handles::require_same_camera() {
  if (!options.gige.serial.empty())
    require_named("serial number", options.gige.serial, name_at(serial_register));
  if (!options.gige.user_name.empty())
    require_named("user name", options.gige.user_name, name_at(user_name_register));
}

std::optional<double> GigeDevice::Handles::chunk_exposure_us(ArvBuffer* buffer) const {
  if (!chunks || !arv_buffer_has_chunks(buffer)) return std::nullopt;
  GigeError error;
  const double exposure =
      arv_chunk_parser_get_float_value(chunks.get(), buffer, "ChunkExposureTime", error.out());
  if (error) return std::nullopt;
  return exposure;
}

// Its pixels are lent where the camera sends them as we want them, and unpacked where it packs them.
ReceivedFrame GigeDevice::Handles::frame_of(GigeBuffers::Full full) {
  ArvBuffer* buffer = full.buffer.get();
  ReceivedFrame frame;
  frame.problem = problem_of(buffer);
  frame.id = arv_buffer_get_frame_id(buffer);
  frame.first_packet = full.first_packet;
  frame.last_packet = full.last_packet;
  const auto* data = static_cast<const std::uint8_t*>(arv_buffer_get_data(buffer, &frame.bytes));
  if (frame.problem.empty()) {
    frame.device_time_ns = arv_buffer_get_timestamp(buffer);
    frame.width_px = arv_buffer_get_image_width(buffer);
    frame.height_px = arv_buffer_get_image_height(buffer);
    frame.pixel_format = arv_buffer_get_image_pixel_format(buffer);
    frame.chunk_exposure_us = chunk_exposure_us(buffer);
  }
  const GigePixels& format = gige_pixels(options);
  const std::size_t wanted = format.picture_bytes(options.width_px, options.height_px);
  const bool enough = arv_buffer_has_chunks(buffer) ? frame.bytes >= wanted : frame.bytes == wanted;
  if (frame.problem.empty() && enough && frame.pixel_format == format.code &&
      frame.width_px == options.width_px && frame.height_px == options.height_px) {
    if (!format.packed) {
      frame.pixels = buffers->lend(std::move(full.buffer), wanted);
      return frame;
    }
    frame.pixels = own_pixels(
        unpacked(format, {data, wanted},
                 static_cast<std::size_t>(options.width_px) * static_cast<std::size_t>(options.height_px)));
  }
  buffers->give_back(std::move(full.buffer));
  return frame;
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

void GigeDevice::Handles::drop_stream() noexcept {
  buffers->close();
  stream.reset();
  buffers.reset();
}

GigeDevice::GigeDevice(const CameraOptions& options) : handles_(std::make_unique<Handles>(options)) {
  (void)gige_pixels(options);  // refuses what no such camera sends, before it looks for one
  Handles& own = *handles_;
  own.find();
  const std::string& address = own.options.gige.address;
  if (!read_register(address, version_register, sign_of_life))
    own.fail("does not answer; check its power, cable and address");
  // Reading this register renews the controller's claim in some devices: not more often than a heartbeat.
  const auto privilege = read_register(address, control_privilege_register, sign_of_life);
  if ((privilege.value_or(0) & control_privilege_bits) != 0) own.fail_in_use();
  NetworkInterface interface;
  {
    const std::lock_guard lock(reads_description);
    // As late as possible: arv_gv_device_finalize dereferences null when arv_gv_device_constructed could not
    // bind to the interface's address, because it went away.
    interface = interface_towards(address, options.gige.interface);
    own.open(interface);
  }
  own.require_same_camera();
  own.features().configure();
  GigePackets(own.device.get(), own.options).configure(interface);
  if (!own.features().chunks()) return;
  const std::lock_guard lock(reads_description);
  own.chunks.reset(arv_camera_create_chunk_parser(own.camera.get()));
}

GigeDevice::~GigeDevice() { close_stream(); }

void GigeDevice::open_stream() {
  Handles& own = *handles_;
  own.buffers = std::make_shared<GigeBuffers>(own.running() ? running_buffers : triggered_buffers);
  GigeError error;
  GigeOwner<ArvStream> stream(
      arv_camera_create_stream(own.camera.get(), on_stream, own.buffers.get(), error.out()));
  own.require(error, "creating the stream");
  g_object_set(
      stream.get(), "socket-buffer", ARV_GV_STREAM_SOCKET_BUFFER_FIXED, "socket-buffer-size",
      GigePackets::socket_buffer_bytes, "packet-resend",
      own.options.gige.resend ? ARV_GV_STREAM_PACKET_RESEND_ALWAYS : ARV_GV_STREAM_PACKET_RESEND_NEVER,
      nullptr);
  const unsigned payload_bytes = arv_camera_get_payload(own.camera.get(), error.out());
  own.require(error, "reading the payload size");
  own.stream = std::move(stream);
  own.buffers->open(own.stream.get(), payload_bytes);
  arv_camera_start_acquisition(own.camera.get(), error.out());
  if (!error) return;
  own.drop_stream();
  own.require(error, "starting the acquisition");
}

void GigeDevice::close_stream() noexcept {
  Handles& own = *handles_;
  if (!own.stream) return;
  GigeError error;
  own.notice_silence();
  if (!own.lost()) arv_camera_stop_acquisition(own.camera.get(), error.out());
  if (!own.lost() && !error) own.wait_until_quiet();
  own.closed_streams = statistics();
  own.drop_stream();
}

bool GigeDevice::streaming() const { return handles_->stream != nullptr; }

bool GigeDevice::idle() const { return handles_->buffers->idle(); }

void GigeDevice::trigger() {
  GigeError error;
  arv_camera_software_trigger(handles_->camera.get(), error.out());
  handles_->require(error, "triggering");
}

std::optional<ReceivedFrame> GigeDevice::receive(TimePoint deadline) {
  constexpr milliseconds slice{100};  // between looks at the heartbeat
  while (!handles_->lost()) {
    const TimePoint until = std::min(deadline, steady_clock::now() + slice);
    if (auto full = handles_->buffers->wait_for_full(until)) return handles_->frame_of(std::move(*full));
    if (until == deadline) return std::nullopt;
  }
  return std::nullopt;
}

double GigeDevice::exposure_us() const { return handles_->features().exposure_us(); }

double GigeDevice::frame_period_us() const { return handles_->features().frame_period_us(); }

GigeHealth GigeDevice::health() const {
  const GigeFeatures features = handles_->features();
  return {features.temperature_c(), features.ptp_state()};
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
