#include "daemon/pictures.h"

#include <fmt/format.h>

#include <algorithm>

namespace zeropose {
namespace {

// What a robot that was taught a position says of it twice: pictures from there belong together.
constexpr double same_hand_mm = 0.1, same_hand_deg = 0.01;

struct Distance {
  double mm = 0, deg = 0;
};

Distance distance(const Pose& X_AB, const Pose& X_AB2) {
  const Vector6 delta = difference(X_AB, X_AB2);
  return {delta.head<3>().norm(), delta.tail<3>().norm() * degrees_per_radian};
}

// A frame that does not hold back the driver's memory.
Frame kept(const Frame& frame) {
  Frame copy = frame;
  std::vector<std::uint8_t> pixels;
  for (int v = 0; v < frame.height_px; ++v) {
    const auto row = frame.row(v);
    pixels.insert(pixels.end(), row.begin(), row.end());
  }
  copy.stride_bytes = static_cast<std::ptrdiff_t>(frame.row_bytes());
  copy.pixels = own_pixels(std::move(pixels));
  return copy;
}

TimePoint oldest_of(const std::vector<Frame>& frames) {
  return std::ranges::min_element(frames, {}, &Frame::received)->received;
}

}  // namespace

Standing standing_of(const Cell& cell, const Job& job, const Request& request) {
  if (job.positions.empty()) return {Code::no_procedure, "job " + job.name + " has no positions", 0};
  if (request.job == 0) return {Code::no_procedure, "no survey runs, whose positions have no job", 0};
  if (request.job != job.number)
    return {Code::unknown_job, fmt::format("job {} is named, {} is selected", request.job, job.number), 0};
  const auto count = static_cast<std::int32_t>(job.positions.size());
  if (request.argument < 1 || request.argument > count)
    return {Code::argument_out_of_range,
            fmt::format("position {} is told, job {} has 1 to {}", request.argument, job.name, count), 0};
  const auto index = static_cast<std::size_t>(request.argument - 1);
  const HandPosition& position = job.positions[index];
  if (cell.hand_of.at(position.cameras.front()) != request.robot)
    return {Code::wrong_position,
            fmt::format("{} is a position of another robot than {}", position.name,
                        cell.robots.at(request.robot).name),
            0};
  const Distance off = distance(position.X_RH, request.X_RH);
  if (off.mm > position.tolerance_mm || off.deg > position.tolerance_deg)
    return {Code::wrong_position,
            fmt::format("the hand is {:.3f} mm and {:.3f} deg away from {}, {:g} mm and {:g} deg are allowed",
                        off.mm, off.deg, position.name, position.tolerance_mm, position.tolerance_deg),
            0};
  return {Code::ok, {}, index};
}

void HandPictures::make_room(std::size_t position, std::uint32_t part, const Pose& X_RH, TimePoint oldest,
                             std::size_t rounds) {
  if (part != part_) places_.clear();
  part_ = part;
  Place& place = places_[position];
  const Distance off = distance(place.X_RH, X_RH);
  auto& known = place.rounds;
  if (off.mm > same_hand_mm || off.deg > same_hand_deg) known.clear();
  std::erase_if(known, [&](const auto& frames) { return oldest_of(frames) < oldest; });
  const auto most = static_cast<std::ptrdiff_t>(rounds) - 1;
  if (std::ssize(known) > most) known.erase(known.begin(), known.end() - most);
  if (known.empty()) place.X_RH = X_RH;
}

void HandPictures::take(std::size_t position, std::span<const Frame> frames) {
  auto& round = places_.at(position).rounds.emplace_back();
  for (const Frame& frame : frames) round.push_back(kept(frame));
}

std::string HandPictures::missing(const Job& job, std::optional<std::uint32_t> part, TimePoint now) const {
  const auto oldest = now - std::chrono::duration<double>(job.positions_within_s);
  std::string names;
  for (std::size_t i = 0; i < job.positions.size(); ++i) {
    const auto place = places_.find(i);
    const bool seen = place != places_.end() && !place->second.rounds.empty() && (!part || *part == part_);
    if (seen && oldest_of(place->second.rounds.back()) >= oldest) continue;
    names += (names.empty() ? "" : ", ") + job.positions[i].name + (seen ? " (too long ago)" : "");
  }
  return names.empty() ? names : "no picture of this part from " + names;
}

std::size_t HandPictures::rounds(const Job& job) const {
  std::size_t least = job.positions.empty() ? 0 : std::numeric_limits<std::size_t>::max();
  for (std::size_t i = 0; i < job.positions.size(); ++i) {
    const auto place = places_.find(i);
    least = std::min(least, place == places_.end() ? 0 : place->second.rounds.size());
  }
  return least;
}

std::vector<Pose> HandPictures::hands(const Job& job) const {
  std::vector<Pose> X_RH;
  for (std::size_t i = 0; i < job.positions.size(); ++i) X_RH.push_back(places_.at(i).X_RH);
  return X_RH;
}

std::vector<Frame> HandPictures::frames(const Job& job, std::size_t back) const {
  std::vector<Frame> frames;
  for (std::size_t i = 0; i < job.positions.size(); ++i) {
    const auto& rounds = places_.at(i).rounds;
    std::ranges::copy(rounds.at(rounds.size() - 1 - back), std::back_inserter(frames));
  }
  return frames;
}

std::vector<std::size_t> eyes_of(const Cell& cell, const Job& job) {
  std::vector<std::size_t> eyes;
  for (const std::size_t camera : cameras_of(job))
    if (camera < cell.cameras.size()) eyes.push_back(camera);
  std::ranges::sort(eyes);
  eyes.erase(std::unique(eyes.begin(), eyes.end()), eyes.end());
  for (std::size_t i = 0; i < hand_eyes(job).size(); ++i) eyes.push_back(cell.cameras.size() + i);
  return eyes;
}

JobPictures job_pictures(const Cell& cell, const Job& job, Grabber& grabber, const HandPictures& hands,
                         std::size_t back, TimePoint deadline) {
  JobPictures pictures;
  pictures.code = Code::ok;
  pictures.eyes = eyes_of(cell, job);
  const std::span fixed(pictures.eyes.begin(), pictures.eyes.end() - std::ssize(hand_eyes(job)));
  if (!fixed.empty()) {
    FrameSet grabbed = grabber.grab_live(fixed, deadline);
    pictures.code = grabbed.code;
    pictures.reason = std::move(grabbed.reason);
    pictures.frames = std::move(grabbed.frames);
    pictures.trigger_spread = grabbed.trigger_spread;
    pictures.device_spread = grabbed.device_spread;
  }
  if (pictures.code == Code::ok)
    std::ranges::move(hands.frames(job, back), std::back_inserter(pictures.frames));
  return pictures;
}

ImageView view_of(const Frame& frame) {
  return {frame.pixels.get(), frame.width_px, frame.height_px, frame.stride_bytes, frame.white};
}

std::vector<CameraImage> images_of(std::span<const std::size_t> eyes, std::span<const Frame> frames) {
  std::vector<CameraImage> images;
  for (std::size_t i = 0; i < eyes.size(); ++i) images.push_back({eyes[i], view_of(frames[i])});
  return images;
}

}  // namespace zeropose
