#include "tests/support/recorder.h"

#include <algorithm>
#include <sstream>

#include "tests/support/raw_modbus.h"

namespace zeropose {
namespace {

constexpr std::size_t remembered_sequences = 64;

ResultBlock without_age(ResultBlock block) {
  block.age_ms = 0;
  return block;
}

}  // namespace

Recorder::Recorder(const RecorderOptions& options, Plausible plausible)
    : options_(options), plausible_(std::move(plausible)) {}

Recorder::~Recorder() { stop(); }

void Recorder::stop() {
  stopping_ = true;
  for (std::thread& thread : threads_) thread.join();
  threads_.clear();
}

void Recorder::watch(const std::string& address, std::uint16_t port, std::uint8_t unit) {
  stopping_ = false;
  threads_.emplace_back([=, this] { poll(address, port, unit); });
}

void Recorder::poll(const std::string& address, std::uint16_t port, std::uint8_t unit) {
  while (!stopping_) {
    try {
      RawModbus client(port, address);
      while (!stopping_) {
        const auto started = Clock::now();
        const Bytes pdu = client.ask(read_pdu(4, 0, reg::block_size), unit);
        if (pdu.size() != 2 + 2 * reg::block_size) break;
        std::vector<std::uint16_t> registers;
        for (std::size_t i = 2; i < pdu.size(); i += 2)
          registers.push_back(static_cast<std::uint16_t>(pdu[i] << 8 | pdu[i + 1]));
        see(registers, started);
      }
    } catch (const std::runtime_error&) {
      std::this_thread::sleep_for(std::chrono::milliseconds(5));  // nobody there at the moment
    }
  }
}

std::function<void(const ResultBlock&)> Recorder::tap() {
  return [this](const ResultBlock& block) { see(encode(block, options_.data_id), Clock::now()); };
}

void Recorder::see(std::span<const std::uint16_t> registers, Clock::time_point read_started) {
  const std::scoped_lock lock(mutex_);
  ++blocks_;
  const DecodedBlock decoded = decode_result(registers, options_.data_id);
  if (decoded.problem) return violation({}, std::string(name_of(*decoded.problem)));
  check_form(decoded.block);
  check_sequence(decoded.block);
  if (!decoded.block.has(status_bit::result_valid)) return;
  ++valid_blocks_;
  check_valid(decoded.block, read_started);
}

void Recorder::check_form(const ResultBlock& b) {
  using namespace status_bit;
  if (b.robot_index != options_.robot_index) violation(b, "another robot's block");
  if (b.epoch == 0) violation(b, "epoch 0");
  if (b.has(result_valid) && (b.status & (not_ok | busy | error))) violation(b, "valid and something else");
  if (b.has(not_ok) && (b.has(busy) || b.code == 0)) violation(b, "not ok, but busy or without a code");
  if (!b.has(result_valid) && b.values != no_values) violation(b, "values without a valid result");
}

// One sequence number, one content: else a robot could not tell that a block has changed.
void Recorder::check_sequence(const ResultBlock& b) {
  const auto key = std::pair(b.epoch, b.sequence);
  const auto [it, is_new] = by_sequence_.emplace(key, without_age(b));
  if (!is_new && it->second != without_age(b)) violation(b, "the same sequence number with another content");
  if (!is_new) return;
  sequences_.push_back(key);  // the number wraps: the smallest is not the oldest
  if (sequences_.size() <= remembered_sequences) return;
  by_sequence_.erase(sequences_.front());
  sequences_.pop_front();
}

void Recorder::check_valid(const ResultBlock& b, Clock::time_point read_started) {
  if (b.code != 0) violation(b, "valid with a code");
  if (b.state != LinkState::ready || !b.has(status_bit::ready | status_bit::exposure_done))
    violation(b, "valid, but not ready or without exposure");
  if (b.age_ms > b.validity_ms) violation(b, "valid beyond its validity");
  const auto it = known_.find(b.request_id);
  if (it == known_.end()) return violation(b, "valid for a request that was never made");
  Known& known = it->second;
  if (known.withdrawn && read_started > *known.withdrawn) violation(b, "valid after it was withdrawn");
  if (known.seen &&
      (known.seen->values != b.values || known.seen->epoch != b.epoch || known.seen->sequence != b.sequence))
    violation(b, "two results for one request");
  known.seen = b;
  check_values(b, known);
}

void Recorder::check_values(const ResultBlock& b, const Known& known) {
  const auto correction = from_wire(options_.convention, b.values);
  if (!correction) return violation(b, "values are no correction");
  if (!known.report && !known.truth && !plausible_) violation(b, "valid, and nobody knows why");
  if (known.report) {
    const bool same =
        known.report->code == Code::ok && to_wire(options_.convention, known.report->correction) == b.values;
    if (!same) violation(b, "not what the cycle reported");
  }
  if (known.truth) {
    const Vector6 d = difference(known.truth->correction, *correction);
    const bool near = d.head<3>().norm() <= known.truth->tolerance_mm &&
                      d.tail<3>().norm() * degrees_per_radian <= known.truth->tolerance_deg;
    if (!near) violation(b, "a wrong correction");
  }
  if (plausible_ && !plausible_(b, *correction)) violation(b, "an implausible correction");
}

void Recorder::violation(const ResultBlock& b, const std::string& what) {
  if (violations_.size() >= 100) return;
  std::ostringstream text;
  text << what << ": request " << b.request_id << ", epoch " << b.epoch << ", sequence " << b.sequence
       << ", status " << b.status << ", code " << b.code << ", values";
  for (const std::int32_t value : b.values) text << ' ' << value;
  violations_.push_back(text.str());
}

void Recorder::requested(std::uint32_t id) {
  const std::scoped_lock lock(mutex_);
  known_[id] = {};
}

void Recorder::reported(const Report& report) {
  const std::scoped_lock lock(mutex_);
  const auto it = known_.find(report.request_id);
  if (it != known_.end() && !it->second.report) it->second.report = report;
}

void Recorder::truth(std::uint32_t id, const Pose& correction, double tolerance_mm, double tolerance_deg) {
  const std::scoped_lock lock(mutex_);
  known_[id].truth = Truth{correction, tolerance_mm, tolerance_deg};
}

void Recorder::withdrawn(std::uint32_t id) {
  const std::scoped_lock lock(mutex_);
  known_[id].withdrawn = Clock::now();
}

std::vector<std::string> Recorder::violations() const {
  const std::scoped_lock lock(mutex_);
  return violations_;
}

std::size_t Recorder::blocks() const {
  const std::scoped_lock lock(mutex_);
  return blocks_;
}

std::size_t Recorder::valid_blocks() const {
  const std::scoped_lock lock(mutex_);
  return valid_blocks_;
}

bool Recorder::saw_valid(std::uint32_t id) const {
  const std::scoped_lock lock(mutex_);
  const auto it = known_.find(id);
  return it != known_.end() && it->second.seen.has_value();
}

}  // namespace zeropose
