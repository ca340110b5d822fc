// Sees every published block and knows what may be valid: any wrong valid result is a violation (spec 85).
//
// Tell it what is asked for before it is asked, and what was taken back after it was taken back; give it the
// reports of the cycle, or the truth, or a judgement of its own.
#pragma once

#include <atomic>
#include <deque>
#include <functional>
#include <map>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "protocol/codec.h"

namespace zeropose {

struct RecorderOptions {
  Convention convention = Convention::generic;
  std::uint16_t robot_index = 1;
  std::uint16_t data_id = default_result_data_id;
};

class Recorder {
 public:
  // May this correction be published? Called with the recorder locked.
  using Plausible = std::function<bool(const ResultBlock& block, const Pose& correction)>;
  using Clock = std::chrono::steady_clock;

  explicit Recorder(const RecorderOptions& options, Plausible plausible = {});
  ~Recorder();
  Recorder(const Recorder&) = delete;
  Recorder& operator=(const Recorder&) = delete;

  // An independent client in a thread of its own reads as fast as the link answers, and connects again when
  // it must.
  void watch(const std::string& address, std::uint16_t port, std::uint8_t unit = 1);
  void stop();
  // For EndpointOptions::tap. The recorder must outlive the endpoint.
  std::function<void(const ResultBlock&)> tap();
  void see(std::span<const std::uint16_t> registers, Clock::time_point read_started);

  void requested(std::uint32_t id);     // before the Measure is written; each id once
  void reported(const Report& report);  // before it is published
  void truth(std::uint32_t id, const Pose& correction, double tolerance_mm, double tolerance_deg);
  void withdrawn(std::uint32_t id);  // after Acknowledge was answered, or the owner's link was closed

  std::vector<std::string> violations() const;  // the first hundred
  std::size_t blocks() const;
  std::size_t valid_blocks() const;
  bool saw_valid(std::uint32_t id) const;

 private:
  struct Truth {
    Pose correction;
    double tolerance_mm, tolerance_deg;
  };
  struct Known {
    std::optional<Report> report;
    std::optional<Truth> truth;
    std::optional<Clock::time_point> withdrawn;
    std::optional<ResultBlock> seen;
  };

  void poll(const std::string& address, std::uint16_t port, std::uint8_t unit);
  void check_form(const ResultBlock& block);
  void check_valid(const ResultBlock& block, Clock::time_point read_started);
  void check_values(const ResultBlock& block, const Known& known);
  void check_sequence(const ResultBlock& block);
  void violation(const ResultBlock& block, const std::string& what);

  const RecorderOptions options_;
  const Plausible plausible_;
  mutable std::mutex mutex_;
  std::map<std::uint32_t, Known> known_;
  std::map<std::pair<std::uint32_t, std::uint16_t>, ResultBlock> by_sequence_;  // epoch, sequence
  std::deque<std::pair<std::uint32_t, std::uint16_t>> sequences_;               // its keys, oldest first
  std::vector<std::string> violations_;
  std::size_t blocks_ = 0, valid_blocks_ = 0;
  std::atomic<bool> stopping_{false};
  std::vector<std::thread> threads_;
};

}  // namespace zeropose
