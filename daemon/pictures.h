// The pictures that a measurement is made from: of the fixed cameras now, of those on a robot's hand from the
// positions that the robot told before (spec 50 M3).
#pragma once

#include <map>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "config/cell.h"
#include "daemon/grab.h"
#include "measure/measurement.h"
#include "protocol/report.h"

namespace zeropose {

// A position of the job that a robot says its hand is at.
struct Standing {
  Code code = Code::internal;
  std::string reason;        // one sentence, empty when ok
  std::size_t position = 0;  // index into the job's, when ok
};

// Codes: no_procedure (the job has no positions, or none is named), unknown_job, argument_out_of_range (the
// index), wrong_position (another robot's, or the hand is not where it was taught).
Standing standing_of(const Cell& cell, const Job& job, const Request& at_position);

// What the cameras on hands saw of one part. Not thread-safe.
class HandPictures {
 public:
  // To be called before the picture is taken, so that none of before stays when that fails. Those of another
  // part go, of this position those older than `oldest` and, but for the newest rounds - 1, all; and all of
  // them when the hand was elsewhere.
  void make_room(std::size_t position, std::uint32_t part, const Pose& X_RH, TimePoint oldest,
                 std::size_t rounds);
  void take(std::size_t position, std::span<const Frame> frames);  // of the position's cameras
  void forget() { places_.clear(); }

  // Which positions have no picture of this part (none given: of the part that was looked at last) or too old
  // a one: one sentence, empty when none.
  std::string missing(const Job& job, std::optional<std::uint32_t> part, TimePoint now) const;

  // How many pictures every position of the job has.
  std::size_t rounds(const Job& job) const;
  // Preconditions: nothing is missing, back < rounds(). back 0: the newest.
  std::vector<Pose> hands(const Job& job) const;                      // by position
  std::vector<Frame> frames(const Job& job, std::size_t back) const;  // as hand_eyes() counts

 private:
  struct Place {
    Pose X_RH = Pose::Identity();
    std::vector<std::vector<Frame>> rounds;  // oldest first; of each the frames of the position's cameras
  };
  std::uint32_t part_ = 0;
  std::map<std::size_t, Place> places_;  // by position
};

// One picture for every camera that the job sees with.
struct JobPictures {
  Code code = Code::internal;
  std::string reason;
  std::vector<std::size_t> eyes;  // as View::camera counts them
  std::vector<Frame> frames;      // of these
  std::chrono::nanoseconds trigger_spread{};
  std::optional<std::chrono::nanoseconds> device_spread;
};

// The cameras of the job that need no position, then those of its positions, as View::camera counts them.
std::vector<std::size_t> eyes_of(const Cell& cell, const Job& job);

// Grabs the fixed cameras and adds the pictures of the hands, `back` rounds ago.
JobPictures job_pictures(const Cell& cell, const Job& job, Grabber& grabber, const HandPictures& hands,
                         std::size_t back, TimePoint deadline);

ImageView view_of(const Frame& frame);
std::vector<CameraImage> images_of(std::span<const std::size_t> eyes, std::span<const Frame> frames);

}  // namespace zeropose
