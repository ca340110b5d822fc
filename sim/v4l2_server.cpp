#include "sim/v4l2_server.h"

#include <algorithm>
#include <chrono>
#include <stdexcept>
#include <utility>

namespace zeropose {
namespace {

// The noise comes anew strip by strip, not picture by picture: where the machine is slow, two frames may
// follow each other before a whole picture is drawn, and must not be the same.
constexpr std::chrono::milliseconds strip_period{10};
constexpr std::size_t strips = 16;

}  // namespace

struct V4l2Server::Slot {
  std::size_t index = 0;
  std::unique_ptr<V4l2Output> output;
  std::uint64_t shown = 0;  // the generation of its picture; guarded by the server's mutex
  std::string problem;      // likewise; not empty: it shows nothing any more
  std::jthread thread;
};

V4l2Server::V4l2Server(const std::vector<Served>& cameras, Draw draw) : draw_(std::move(draw)) {
  for (const Served& camera : cameras) {
    auto slot = std::make_unique<Slot>();
    slot->index = slots_.size();
    slot->output = std::make_unique<V4l2Output>(
        ShownPicture{output_beside(camera.capture), camera.capture, camera.width_px, camera.height_px});
    slots_.push_back(std::move(slot));
  }
  for (const auto& slot : slots_)
    slot->thread =
        std::jthread([this, own = slot.get()](const std::stop_token& stop) { keep_showing(*own, stop); });
  picture_changed();
}

V4l2Server::~V4l2Server() {
  for (const auto& slot : slots_) slot->thread.request_stop();
}

// A new scene comes as a whole; new noise of the same scene is written into the picture that is shown.
void V4l2Server::keep_showing(Slot& slot, const std::stop_token& stop) {
  std::vector<std::uint8_t> fresh(slot.output->shown().size());
  std::uint64_t last = 0;
  std::size_t strip = 0;
  while (!stop.stop_requested()) {
    std::uint64_t generation = 0;
    {
      std::unique_lock lock(mutex_);
      changed_.wait_for(lock, stop, strip_period, [&] { return generation_ != last; });
      generation = generation_;
    }
    std::string problem;
    if (generation == last) {
      const std::size_t begin = fresh.size() * strip / strips, end = fresh.size() * (strip + 1) / strips;
      draw_(slot.index, slot.output->shown().subspan(begin, end - begin), begin);
      strip = (strip + 1) % strips;
    } else {
      draw_(slot.index, fresh, 0);
      try {
        slot.output->show(fresh);
      } catch (const std::runtime_error& error) {
        problem = error.what();
      }
    }
    last = generation;
    const std::lock_guard lock(mutex_);
    slot.shown = generation;
    slot.problem = problem;
    changed_.notify_all();
    if (!problem.empty()) return;
  }
}

void V4l2Server::picture_changed() {
  constexpr std::chrono::seconds patience{20};
  std::unique_lock lock(mutex_);
  const std::uint64_t wanted = ++generation_;
  changed_.notify_all();
  const auto done = [&](const auto& slot) { return slot->shown >= wanted || !slot->problem.empty(); };
  if (!changed_.wait_for(lock, patience, [&] { return std::ranges::all_of(slots_, done); }))
    throw std::runtime_error("a V4L2 output does not show its picture");
  for (const auto& slot : slots_)
    if (!slot->problem.empty()) throw std::runtime_error(slot->problem);
}

}  // namespace zeropose
