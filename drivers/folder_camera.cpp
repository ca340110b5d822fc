#include "drivers/folder_camera.h"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <iterator>
#include <thread>
#include <utility>

#include "drivers/folder_listing.h"
#include "drivers/picture_file.h"

namespace zeropose {
namespace {

using std::chrono::steady_clock;

std::string size_text(int width_px, int height_px) {
  return std::to_string(width_px) + " x " + std::to_string(height_px) + " px";
}

// What the pixel format says, so that a dark picture of a series has the white of all others.
int white_of(PixelFormat format) {
  switch (format) {
    case PixelFormat::mono10:
    case PixelFormat::mono10_packed:
      return 1023;
    case PixelFormat::mono12:
    case PixelFormat::mono12_packed:
      return 4095;
    case PixelFormat::mono16:
      return 65535;
    case PixelFormat::mono8:
    case PixelFormat::yuyv:
    case PixelFormat::mjpeg:
      break;
  }
  return 255;
}

std::string bytes_of(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

}  // namespace

FolderCamera::FolderCamera(CameraOptions options) : options_(std::move(options)) {
  if (options_.trigger == TriggerSource::line)
    throw DeviceError(title_of(options_) +
                      ": a folder has no trigger line; its trigger is software or free_run");
  if (options_.trigger == TriggerSource::free_run && !options_.frame_rate_hz)
    throw DeviceError(title_of(options_) + ": free_run of a folder needs frame_rate_hz");
}

void FolderCamera::start() {
  pictures_ = pictures_in(options_.folder.path);
  check();
  if (pictures_.empty())
    throw DeviceError(title_of(options_) +
                      ": there is no picture in the folder; put png, tiff, bmp or pgm files of " +
                      size_text(options_.width_px, options_.height_px) + " there");
  first_turn_ = turn_ = 0;
  started_ = triggered_ = steady_clock::now();
}

void FolderCamera::check() {
  std::error_code error;
  if (!std::filesystem::is_directory(options_.folder.path, error))
    throw DeviceError(title_of(options_) +
                      ": there is no such folder; make it, or correct \"path\" in the cell file");
}

void FolderCamera::trigger() { triggered_ = steady_clock::now(); }

void FolderCamera::refuse(DeviceFault fault, const std::string& what) {
  ++(fault == DeviceFault::wrong_size ? statistics_.wrong_size : statistics_.damaged);
  throw DeviceError(title_of(options_) + ": " + what, fault);
}

// When the next frame is exposed, with turn_ set to it; nullopt: after the deadline.
std::optional<TimePoint> FolderCamera::next_turn(TimePoint deadline) {
  if (options_.trigger == TriggerSource::software) return triggered_;
  const std::chrono::duration<double> period(1 / *options_.frame_rate_hz);
  const auto due = [&](std::uint64_t turn) {
    return started_ + std::chrono::duration_cast<steady_clock::duration>(static_cast<double>(turn) * period);
  };
  std::uint64_t turn = static_cast<std::uint64_t>(std::max(0.0, std::ceil((triggered_ - started_) / period)));
  turn = std::max(turn, turn_);
  if (due(turn) > deadline) {
    std::this_thread::sleep_until(deadline);
    return std::nullopt;
  }
  turn_ = turn;
  std::this_thread::sleep_until(due(turn));
  return due(turn);
}

void FolderCamera::begin_pass(std::uint64_t turn) {
  std::vector<std::filesystem::path> now = pictures_in(options_.folder.path);
  if (options_.folder.loop) {
    first_turn_ = turn - (turn - first_turn_) % pictures_.size();
    if (!now.empty()) pictures_ = std::move(now);
    if (turn - first_turn_ >= pictures_.size()) first_turn_ = turn;
    return;
  }
  const std::string last = pictures_.back().filename().string();
  for (auto& path : now)
    if (natural_less(last, path.filename().string())) pictures_.push_back(std::move(path));
  if (turn - first_turn_ < pictures_.size()) return;
  refuse(DeviceFault::damaged_frame, "all " + std::to_string(pictures_.size()) +
                                         " pictures were used; add more, or set \"loop\" in the cell file");
}

const std::filesystem::path& FolderCamera::picture(std::uint64_t turn) {
  if (turn - first_turn_ >= pictures_.size()) begin_pass(turn);
  return pictures_[static_cast<std::size_t>(turn - first_turn_)];
}

std::optional<Frame> FolderCamera::grab(TimePoint deadline) {
  const std::optional<TimePoint> exposed = next_turn(deadline);
  if (!exposed) {
    ++statistics_.timeouts;
    return std::nullopt;
  }
  const std::filesystem::path path = picture(turn_);
  ++turn_;
  Frame frame = load(path);
  frame.triggered = *exposed;
  frame.received = steady_clock::now();
  frame.device_time_ns = static_cast<std::uint64_t>(
      std::chrono::duration_cast<std::chrono::nanoseconds>(*exposed - started_).count());
  frame.sequence = ++statistics_.frames;
  return frame;
}

Frame FolderCamera::load(const std::filesystem::path& path) {
  const std::string name = path.filename().string();
  std::optional<StoredPicture> stored = decode_picture(bytes_of(path));
  if (!stored)
    refuse(DeviceFault::damaged_frame,
           name + " is no picture (PNG, TIFF, BMP or PGM, 8 or 16 bit) or cannot be read; remove it");
  if (stored->width_px != options_.width_px || stored->height_px != options_.height_px)
    refuse(DeviceFault::wrong_size, name + " has " + size_text(stored->width_px, stored->height_px) +
                                        ", expected are " + size_text(options_.width_px, options_.height_px));
  Frame frame;
  frame.camera = options_.name;
  frame.width_px = stored->width_px;
  frame.height_px = stored->height_px;
  frame.white = stored->white > 255 ? std::max(stored->white, white_of(options_.format)) : 255;
  frame.stride_bytes = static_cast<std::ptrdiff_t>(frame.row_bytes());
  frame.pixels = own_pixels(std::move(stored->pixels));
  return frame;
}

}  // namespace zeropose
