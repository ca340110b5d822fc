// The cycle: command -> grab -> measure -> report, one after the other in a thread of its own (spec 90).
#pragma once

#include <atomic>
#include <condition_variable>
#include <deque>
#include <filesystem>
#include <functional>
#include <future>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <thread>

#include "config/cell.h"
#include "config/records.h"
#include "daemon/camera_health.h"
#include "daemon/grab.h"
#include "daemon/overlay.h"
#include "daemon/pictures.h"
#include "daemon/survey.h"
#include "measure/measurement.h"
#include "measure/proposal.h"
#include "protocol/robot_link.h"

namespace zeropose {

// One measurement with the frames it was made from.
struct MeasureOutcome {
  const Job* job = nullptr;  // of the cell
  Measurement measurement;
  std::vector<Frame> frames;         // in the order of the job's cameras; empty when the grab failed
  std::vector<CameraHealth> health;  // of these cameras, likewise
  std::chrono::nanoseconds grab{}, compute{};
  std::chrono::nanoseconds trigger_spread{};              // of the frames, as in FrameSet
  std::optional<std::chrono::nanoseconds> device_spread;  // likewise
  Proposal proposal;                                      // of measure_now() where a camera was moved
};

struct ZeroOutcome {
  Code code = Code::internal;
  std::string reason;
  std::optional<ZeroRecord> record;
  Vector6 spread = Vector6::Zero();  // mm, rad
};

// One frame of a camera with what the selected job finds in it.
struct Snapshot {
  GrabResult grabbed;
  std::vector<MarkOverlay> marks;
  std::vector<GapOverlay> gaps;
  std::optional<LineArrayResult> lines;  // of a wheel's projector
};

struct SurveyState {
  std::uint64_t number = 0;            // of this survey, counted from 1 since the start
  std::optional<Survey> survey;        // none runs
  std::string last_problem;            // of the last position that was told; empty: it was taken
  std::optional<std::size_t> robot{};  // that goes through it; others are none of it
};

struct CameraStatus {
  std::string name;
  CameraState state = CameraState::opening;
  std::string last_problem;
  CameraStatistics statistics;
  CameraCheck check;    // its reference points, when they were last looked at
  CameraHealth health;  // of its pictures
};

struct Status {
  std::string job;
  bool ready = false;  // a Measure would be taken now
  Code zero_code = Code::zero_missing;
  std::string zero_reason;  // why there is none, one sentence
  std::optional<ZeroRecord> zero;
  std::vector<CameraStatus> cameras;
  bool cameras_known = false;            // every camera was tried at least once
  Proposal proposal;                     // of the last measurement that found a camera moved
  std::uint64_t cycles = 0;              // requests of robots carried out
  std::optional<Measurement> last_gaps;  // the last measurement of the job, where it evens gaps
};

// Of the deadline, kept for measuring and publishing.
inline constexpr std::chrono::milliseconds compute_reserve{25};

class Cycle {
 public:
  // Opens the cameras in the background and reads the zeros from the state directory.
  Cycle(Cell cell, std::filesystem::path state);
  ~Cycle();
  Cycle(const Cycle&) = delete;
  Cycle& operator=(const Cycle&) = delete;

  // Call for every robot in the order of the cell, then start(). The links must outlive stop().
  void add_link(RobotLink& link) { links_.push_back(&link); }
  void start();
  void stop();

  // Takes over a robot's request; does not wait for it.
  void enqueue(const Request& request);

  // For the command line: run between the robots' requests and wait for the outcome. Never seen by a robot.
  MeasureOutcome measure_now();
  ZeroOutcome zero_now();
  Snapshot snapshot_now(std::size_t camera);

  // While a survey runs AtPosition belongs to it. A new one takes the place of the old one. One that nobody
  // asks for any more ends by itself; sooner where it tells a robot where to go. Returns its number.
  std::uint64_t start_survey(const SurveyOptions& options);
  // What it has gathered, and the last position that was not taken.
  SurveyState survey_now();
  void end_survey(std::uint64_t number);  // another one goes on

  Status status() const;
  const Cell& cell() const { return cell_; }
  // When the cycle thread last came round; the watchdog is fed from it.
  TimePoint last_progress() const { return last_progress_.load(); }

 private:
  using Task = std::function<void()>;
  // A measurement that found a camera moved, and what it was made from.
  struct Moved {
    const Job* job = nullptr;
    std::vector<std::size_t> eyes;
    std::vector<Frame> frames;
    std::vector<CalibratedCamera> cameras;
    Measurement measurement;
  };
  // What became of a position that a robot told.
  struct Told {
    Code code = Code::internal;
    std::string reason;
  };

  void run();
  std::optional<Task> next_task();
  template <typename Result>
  Result run_between(std::function<Result()> work);
  void refresh();

  void carry_out(const Request& request);
  Report report_for(const Request& request);
  void select(std::size_t job);
  // A picture of the camera on the hand, for the next measurement or zero of that part; a survey's otherwise.
  Code at_position(const Request& request);
  Told look_from_hand(const Request& request);
  Told told_survey(const Request& request);
  Told look_for_survey(const Request& request);
  // Shows the survey's robot where to go after this position; without a survey nobody goes anywhere.
  void show_target(int after);
  void end_forgotten_survey();
  void forget_survey();
  FrameSet grab_for(const Request& request, std::span<const std::size_t> cameras);
  // part: whose pictures from hands count; none: of whichever was looked at last.
  MeasureOutcome measure(std::optional<std::uint32_t> part, TimePoint deadline,
                         const std::function<void()>& on_exposed);
  ZeroOutcome take_zero(std::optional<std::uint32_t> part, TimePoint deadline);
  void keep(const Job& job, const ZeroResult& result, std::size_t frames, ZeroOutcome& outcome);
  Snapshot snapshot(std::size_t camera);
  void find_gaps(std::size_t camera, Snapshot& snapshot) const;
  // Measures gaps are for the robot alone that carries cameras and pane: why another one gets none.
  std::string not_for(const Job& job, std::size_t robot) const;
  void remember(const ReferenceCheck& check);
  bool a_camera_moved() const;
  // Where the cameras are that the last measurement found moved; takes its time, so the robot is answered
  // before.
  void propose_places();
  void forget_checks();  // with a new zero or another job
  void load_zeros();

  const Cell cell_;
  const std::filesystem::path state_;
  std::vector<RobotLink*> links_;
  Grabber grabber_;

  // Only the cycle thread touches these once it runs.
  std::size_t selected_ = 0;       // job
  std::vector<StoredZero> zeros_;  // one per job
  // The last result that a robot was sent as valid: what the step limit compares with. None after the start,
  // a new zero, a change of job and a Reset.
  std::optional<Pose> X_O0O_last_;
  ReferenceTrend trend_;                  // since the zero of the selected job
  std::vector<CameraCheck> checks_;       // by camera, when its references were last looked at
  std::vector<CameraHealth> health_;      // by camera
  std::optional<Moved> moved_;            // until something is proposed
  Proposal proposal_;                     // since the zero of the selected job
  HandPictures hands_;                    // of the selected job
  std::optional<Measurement> last_gaps_;  // of the selected job
  SurveyState survey_;

  mutable std::mutex mutex_;
  std::condition_variable wake_;
  std::deque<Task> robot_tasks_, other_tasks_;
  bool reset_waits_ = false;  // among the robots' tasks
  Status status_;
  bool stopping_ = false;
  std::atomic<TimePoint> last_progress_{};
  std::atomic<TimePoint> survey_asked_{};  // when the survey was last asked for
  std::thread thread_;
};

template <typename Result>
Result Cycle::run_between(std::function<Result()> work) {
  auto task = std::make_shared<std::packaged_task<Result()>>(std::move(work));
  std::future<Result> result = task->get_future();
  {
    const std::lock_guard lock(mutex_);
    if (stopping_) throw std::runtime_error("the daemon is stopping");
    other_tasks_.push_back([task] { (*task)(); });
  }
  wake_.notify_all();
  return result.get();
}

}  // namespace zeropose
