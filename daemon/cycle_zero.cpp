// The zero measurements of the cycle: read at the start, taken, kept.
#include <spdlog/spdlog.h>

#include "daemon/cycle.h"
#include "measure/wheel_job.h"

namespace zeropose {
namespace {

using Clock = std::chrono::steady_clock;

std::string hex(std::uint32_t number) { return fmt::format("{:08x}", number); }

std::string needs_none(const Job& job) {
  return "job " + job.name + " evens gaps and needs no zero measurement";
}

}  // namespace

// A zero that cannot be used is no reason not to run: the cell is not ready and says so.
void Cycle::load_zeros() {
  std::filesystem::create_directories(state_);
  for (const Job& job : cell_.jobs) {
    if (job.gaps) {
      zeros_.push_back({Code::no_procedure, needs_none(job), {}});
      continue;
    }
    const StoredZero& zero = zeros_.emplace_back(load_zero_for(state_, cell_, job));
    if (zero.record)
      spdlog::info("job {}: zero {} of {}", job.name, hex(zero.record->id), zero.record->time_utc);
    else
      spdlog::warn("{}; take a new zero", zero.reason);
  }
}

ZeroOutcome Cycle::take_zero(std::optional<std::uint32_t> part, TimePoint deadline) {
  const Job& job = cell_.jobs[selected_];
  if (job.gaps) return {Code::no_procedure, needs_none(job), {}, Vector6::Zero()};
  if (std::string missing = hands_.missing(job, part, Clock::now()); !missing.empty())
    return {Code::position_missing, std::move(missing), {}, Vector6::Zero()};
  const auto cameras = cameras_for(cell_, job, hands_.hands(job));
  const auto rounds =
      job.positions.empty() ? static_cast<std::size_t>(cell_.zero_frames) : hands_.rounds(job);
  std::vector<std::vector<Observation>> observations;
  std::vector<WheelResult> wheels;
  std::vector<std::vector<MarkFinding>> references;
  for (std::size_t i = 0; i < rounds; ++i) {
    last_progress_ = Clock::now();
    const JobPictures grabbed =
        job_pictures(cell_, job, grabber_, hands_, job.positions.empty() ? 0 : i,
                     std::min(deadline - compute_reserve, Clock::now() + cell_.deadline));
    if (grabbed.code != Code::ok) return {grabbed.code, grabbed.reason, {}, Vector6::Zero()};
    const auto images = images_of(grabbed.eyes, grabbed.frames);
    if (job.wheel)
      wheels.push_back(look_at_wheel(images, job, cameras, {}));
    else
      observations.push_back(observations_of(find_job_marks(images, job, cameras, job.X_WO_nominal), job));
    references.push_back(find_references(images, cell_.references, cell_.calibration));
  }
  ZeroResult result = job.wheel ? make_wheel_zero(job, wheels) : make_zero(cameras, job, observations);
  if (result.code == Code::ok) {
    ReferenceZero fixed = average_references(cell_.references, cell_.calibration, references);
    result.code = fixed.code;
    result.reason = std::move(fixed.reason);
    result.zero.references = std::move(fixed.references);
  }
  ZeroOutcome outcome{result.code, result.reason, {}, result.spread};
  if (result.code == Code::ok) keep(job, result, rounds, outcome);
  return outcome;
}

// A zero counts once it is safely on disk, not before.
void Cycle::keep(const Job& job, const ZeroResult& result, std::size_t frames, ZeroOutcome& outcome) {
  ZeroRecord record;
  record.job = job.name;
  record.zero = result.zero;
  record.spread = result.spread;
  record.frames = static_cast<int>(frames);
  record.config_hash = cell_.config_hash;
  record.calibration_hash = cell_.calibration_hash;
  record.time_utc = iso8601_utc(std::chrono::system_clock::now());
  try {
    record.id = save_zero(state_, record);
  } catch (const std::exception& error) {
    spdlog::error("the zero is not saved: {}", error.what());
    outcome.code = Code::storage_failed;
    outcome.reason = error.what();
    return;
  }
  outcome.record = record;
  zeros_[selected_] = {Code::ok, {}, record};
  X_O0O_last_.reset();
  forget_checks();
  spdlog::info("job {}: zero {} taken", job.name, hex(record.id));
}

}  // namespace zeropose
