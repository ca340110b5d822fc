#include "sim/gige_server.h"

#include <arpa/inet.h>
#include <arv.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cerrno>
#include <cstring>
#include <stdexcept>
#include <utility>

namespace zeropose {
namespace {

constexpr std::uint16_t control_port = 3956;  // GigE Vision 2.0, GVCP
// A software trigger is looked at on this grid. Finer costs idle time: the fake spins up to 1 ms per step.
constexpr double trigger_grid_hz = 200;

constexpr std::chrono::milliseconds wake_period{6};  // above one step of the grid

sockaddr_in control_address(const std::string& address) {
  sockaddr_in there{};
  there.sin_family = AF_INET;
  there.sin_port = htons(control_port);
  ::inet_pton(AF_INET, address.c_str(), &there.sin_addr);
  return there;
}

// Sends a request that changes nothing (READREG of the version) and does not wait for the answer.
void wake(const std::string& address) {
  constexpr std::array<std::uint8_t, 12> request = {0x42, 0x01, 0x00, 0x80, 0x00, 0x04, 0x00, 0x01};
  const sockaddr_in there = control_address(address);
  const int fd = ::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  if (fd < 0) return;
  (void)::sendto(fd, request.data(), request.size(), 0, std::bit_cast<const sockaddr*>(&there), sizeof there);
  ::close(fd);
}

struct Unref {
  void operator()(gpointer object) const { g_object_unref(object); }
};

constexpr int bits_of(ArvPixelFormat format) {
  switch (format) {
    case ARV_PIXEL_FORMAT_MONO_10:
    case ARV_PIXEL_FORMAT_MONO_10_PACKED:
      return 10;
    case ARV_PIXEL_FORMAT_MONO_12:
    case ARV_PIXEL_FORMAT_MONO_12_PACKED:
      return 12;
    default:
      return 16;
  }
}

// As GigE Vision sends them: two bytes, the lower one first; or packed, where the first pixel of a pair has
// the first byte for its upper eight bits and the lower half of the second for the rest, the other pixel the
// third byte and the upper half.
void write_deep(std::span<const std::uint8_t> grey, ArvPixelFormat format, std::uint8_t* out) {
  const int bits = bits_of(format);
  const bool packed = ARV_PIXEL_FORMAT_BIT_PER_PIXEL(format) == 12;
  for (std::size_t i = 0; i < grey.size(); ++i) {
    const unsigned level = grey[i] * 257u >> (16 - bits);
    if (!packed) {
      out[2 * i] = static_cast<std::uint8_t>(level & 255u);
      out[2 * i + 1] = static_cast<std::uint8_t>(level >> 8);
      continue;
    }
    std::uint8_t* three = out + i / 2 * 3;
    const unsigned rest = level & ((1u << (bits - 8)) - 1);
    three[i % 2 == 0 ? 0 : 2] = static_cast<std::uint8_t>(level >> (bits - 8));
    three[1] = static_cast<std::uint8_t>(i % 2 == 0 ? rest : three[1] | rest << 4);
  }
}

// The fake binds its sockets without telling when it cannot.
void require_free(const ServedCamera& camera) {
  const std::string who = "camera " + camera.name + ": ";
  in_addr parsed{};
  if (::inet_pton(AF_INET, camera.address.c_str(), &parsed) != 1)
    throw std::runtime_error(who + "'" + camera.address + "' is not an IPv4 address");
  const sockaddr_in address = control_address(camera.address);
  const int fd = ::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  if (fd < 0) throw std::runtime_error(who + "no UDP socket: " + std::strerror(errno));
  const bool bound = ::bind(fd, std::bit_cast<const sockaddr*>(&address), sizeof address) == 0;
  const int error = errno;
  ::close(fd);
  if (!bound && error == EADDRINUSE)
    throw std::runtime_error(who + camera.address + " is already served (UDP port 3956); stop that program");
  if (!bound && error != EADDRNOTAVAIL)
    throw std::runtime_error(who + camera.address + ": " + std::strerror(error));
}

}  // namespace

// One camera and its next picture. Everything but `device` is guarded by the server's mutex.
struct GigeServer::Slot {
  GigeServer* server = nullptr;
  ServedCamera camera;
  std::size_t index = 0;
  std::vector<std::uint8_t> picture;
  bool ready = false;     // the picture is of the current generation and was not exposed yet
  bool stopping = false;  // nobody waits for pictures any more
  std::unique_ptr<ArvGvFakeCamera, Unref> device;  // guarded by control
  mutable std::mutex control;                      // one start or stop at a time; taken before the server's

  ArvFakeCamera* registers() const { return arv_gv_fake_camera_get_fake_camera(device.get()); }
  void start();
};

void GigeServer::Slot::start() {
  require_free(camera);
  const std::string serial = camera.serial.empty() ? "ZP-" + camera.address : camera.serial;  // must differ
  std::unique_ptr<ArvGvFakeCamera, Unref> made(
      camera.genicam.empty()
          ? arv_gv_fake_camera_new(camera.address.c_str(), serial.c_str())
          : arv_gv_fake_camera_new_full(camera.address.c_str(), serial.c_str(), camera.genicam.c_str()));
  if (made == nullptr || !arv_gv_fake_camera_is_running(made.get()))
    throw std::runtime_error("camera " + camera.name + ": address " + camera.address +
                             " is on no network interface; as root: ip addr add " + camera.address +
                             "/8 dev lo");
  device = std::move(made);
  const auto width = static_cast<guint32>(camera.width_px), height = static_cast<guint32>(camera.height_px);
  arv_fake_camera_write_register(registers(), ARV_FAKE_CAMERA_REGISTER_SENSOR_WIDTH, width);
  arv_fake_camera_write_register(registers(), ARV_FAKE_CAMERA_REGISTER_SENSOR_HEIGHT, height);
  arv_fake_camera_write_register(registers(), ARV_FAKE_CAMERA_REGISTER_WIDTH, width);
  arv_fake_camera_write_register(registers(), ARV_FAKE_CAMERA_REGISTER_HEIGHT, height);
  arv_fake_camera_set_trigger_frequency(registers(), trigger_grid_hz);
  constexpr guint32 user_name_register = 0xe8;  // GigE Vision 2.0, bootstrap
  if (!camera.user_name.empty())
    arv_fake_camera_write_memory(registers(), user_name_register,
                                 static_cast<guint32>(camera.user_name.size() + 1), camera.user_name.c_str());
  const auto fill = [](ArvBuffer* buffer, void* slot_pointer, guint32, guint32, ArvPixelFormat format) {
    auto* slot = static_cast<Slot*>(slot_pointer);
    std::size_t unknown = 0;  // the library reports no size yet
    auto* data = static_cast<std::uint8_t*>(const_cast<void*>(arv_buffer_get_data(buffer, &unknown)));
    const auto bytes = static_cast<std::size_t>(arv_buffer_get_image_width(buffer)) *
                       static_cast<std::size_t>(arv_buffer_get_image_height(buffer));
    if (ARV_PIXEL_FORMAT_BIT_PER_PIXEL(format) == 8) return slot->server->expose(*slot, {data, bytes});
    std::vector<std::uint8_t> grey(bytes);
    slot->server->expose(*slot, grey);
    write_deep(grey, format, data);
  };
  arv_fake_camera_set_fill_pattern(registers(), fill, this);
}

GigeServer::GigeServer(std::vector<ServedCamera> cameras, Draw draw) : draw_(std::move(draw)) {
  for (ServedCamera& camera : cameras) {
    auto slot = std::make_unique<Slot>();
    slot->server = this;
    slot->index = slots_.size();
    slot->picture.resize(static_cast<std::size_t>(camera.width_px) *
                         static_cast<std::size_t>(camera.height_px));
    slot->camera = std::move(camera);
    slot->start();
    slots_.push_back(std::move(slot));
  }
  drawer_ = std::jthread([this](const std::stop_token& stop) { draw_pictures(stop); });
  waker_ = std::jthread([this](const std::stop_token& stop) { wake_cameras(stop); });
}

GigeServer::~GigeServer() {
  waker_ = {};
  for (std::size_t i = 0; i < slots_.size(); ++i) stop_camera(i);
  drawer_ = {};
}

void GigeServer::picture_changed() {
  const std::lock_guard lock(mutex_);
  ++generation_;
  for (auto& slot : slots_) slot->ready = false;
  changed_.notify_all();
}

// Called by the camera when it exposes.
void GigeServer::expose(Slot& slot, std::span<std::uint8_t> pixels) {
  std::unique_lock lock(mutex_);
  changed_.wait(lock, [&] { return slot.ready || slot.stopping; });
  if (slot.stopping) return;  // all its packets are being dropped
  std::copy_n(slot.picture.begin(), std::min(pixels.size(), slot.picture.size()), pixels.begin());
  slot.ready = false;
  changed_.notify_all();
}

GigeServer::Slot* GigeServer::next_empty() {
  for (std::size_t i = 1; i <= slots_.size(); ++i) {
    Slot* slot = slots_[(last_drawn_ + i) % slots_.size()].get();
    if (!slot->ready && !slot->stopping) return slot;
  }
  return nullptr;
}

void GigeServer::draw_pictures(const std::stop_token& stop) {
  std::vector<std::uint8_t> fresh;
  std::unique_lock lock(mutex_);
  while (!stop.stop_requested()) {
    Slot* slot = next_empty();
    if (slot == nullptr) {
      changed_.wait(lock, stop, [this] { return next_empty() != nullptr; });
      continue;
    }
    last_drawn_ = slot->index;
    const std::uint64_t generation = generation_;
    fresh.resize(slot->picture.size());
    lock.unlock();
    draw_(slot->index, fresh);
    lock.lock();
    if (generation != generation_) continue;
    slot->picture.swap(fresh);
    slot->ready = true;
    changed_.notify_all();
  }
}

// About once in a thousand triggers the fake sleeps 0.1 s instead of until the next step of its grid (it
// subtracts times without sign). Any control packet wakes it: a camera that left a trigger waiting gets one.
void GigeServer::wake_cameras(const std::stop_token& stop) const {
  std::vector<guint32> before(slots_.size(), 0);
  while (!stop.stop_requested()) {
    std::this_thread::sleep_for(wake_period);
    for (const auto& slot : slots_) {
      const std::unique_lock control(slot->control, std::try_to_lock);
      if (!control || !slot->device) continue;
      guint32 waiting = 0;
      arv_fake_camera_read_register(slot->registers(), ARV_FAKE_CAMERA_REGISTER_TRIGGER_SOFTWARE, &waiting);
      if (waiting != 0 && before[slot->index] != 0) wake(slot->camera.address);
      before[slot->index] = waiting;
    }
  }
}

void GigeServer::stop_camera(std::size_t camera) {
  Slot& slot = *slots_.at(camera);
  const std::lock_guard control(slot.control);
  if (!slot.device) return;
  g_object_set(slot.device.get(), "gvsp-lost-ratio", 1.0, nullptr);
  {
    const std::lock_guard lock(mutex_);
    slot.stopping = true;
    changed_.notify_all();
  }
  slot.device.reset();
}

void GigeServer::start_camera(std::size_t camera) {
  Slot& slot = *slots_.at(camera);
  const std::lock_guard control(slot.control);
  if (slot.device) return;
  {
    const std::lock_guard lock(mutex_);
    slot.stopping = false;
    changed_.notify_all();
  }
  slot.start();
}

bool GigeServer::running(std::size_t camera) const {
  const Slot& slot = *slots_.at(camera);
  const std::lock_guard control(slot.control);
  return slot.device != nullptr;
}

void GigeServer::lose_packets(std::size_t camera, double ratio) {
  const Slot& slot = *slots_.at(camera);
  const std::lock_guard control(slot.control);
  if (slot.device) g_object_set(slot.device.get(), "gvsp-lost-ratio", ratio, nullptr);
}

void GigeServer::send_narrower(std::size_t camera, int width_px) {
  const Slot& slot = *slots_.at(camera);
  const std::lock_guard control(slot.control);
  if (slot.device)
    arv_fake_camera_write_register(slot.registers(), ARV_FAKE_CAMERA_REGISTER_WIDTH,
                                   static_cast<guint32>(width_px));
}

std::uint32_t GigeServer::read_register(std::size_t camera, std::uint32_t address) const {
  const Slot& slot = *slots_.at(camera);
  const std::lock_guard control(slot.control);
  guint32 value = 0;
  if (slot.device) arv_fake_camera_read_register(slot.registers(), address, &value);
  return value;
}

void GigeServer::write_register(std::size_t camera, std::uint32_t address, std::uint32_t value) {
  const Slot& slot = *slots_.at(camera);
  const std::lock_guard control(slot.control);
  if (slot.device) arv_fake_camera_write_register(slot.registers(), address, value);
}

void GigeServer::run_free(std::size_t camera, double frames_per_second) {
  const Slot& slot = *slots_.at(camera);
  const std::lock_guard control(slot.control);
  if (!slot.device) return;
  const bool free = frames_per_second > 0;
  if (free)
    arv_fake_camera_write_register(slot.registers(), ARV_FAKE_CAMERA_REGISTER_ACQUISITION_FRAME_PERIOD_US,
                                   static_cast<guint32>(1e6 / frames_per_second));
  arv_fake_camera_write_register(slot.registers(), ARV_FAKE_CAMERA_REGISTER_TRIGGER_MODE, free ? 0 : 1);
}

}  // namespace zeropose
