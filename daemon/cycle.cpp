#include "daemon/cycle.h"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <numeric>

#include "measure/wheel_job.h"

namespace zeropose {
namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;

constexpr auto idle_period = 100ms;  // how often the cell's state is looked at when nothing is asked

// Where the robot's base stands as the request says. Without an axis the argument means nothing.
Pose base_of(const RobotOptions& robot, const Request& request) {
  constexpr double mm_per_um = 1e-3;
  return robot.axis ? base_at(*robot.axis, robot.X_WR, mm_per_um * request.argument) : robot.X_WR;
}

void log_change(const CameraStatus& camera) {
  if (camera.state == CameraState::alive)
    spdlog::info("{} is there", camera.name);
  else
    spdlog::warn("{} is missing: {}", camera.name, camera.last_problem);
}

void log_proposal(const CalibratedCamera& camera, const CameraProposal& proposal) {
  if (!proposal.X_CoCn)
    return spdlog::warn("{}: where it is now is not known: {}", camera.name, proposal.reason);
  spdlog::warn("{}: by {} reference points it turned by {:.4f} deg and went {:.3f} mm", camera.name,
               proposal.points.size(), degrees_per_radian * log_so3(proposal.X_CoCn->linear()).norm(),
               proposal.X_CoCn->translation().norm());
}

long microseconds(std::chrono::nanoseconds time) {
  return std::chrono::duration_cast<std::chrono::microseconds>(time).count();
}

}  // namespace

Cycle::Cycle(Cell cell, std::filesystem::path state)
    : cell_(std::move(cell)), state_(std::move(state)), grabber_(cell_.cameras) {
  forget_checks();
  load_zeros();
}

Cycle::~Cycle() { stop(); }

void Cycle::start() {
  last_progress_ = Clock::now();
  thread_ = std::thread([this] { run(); });
}

void Cycle::stop() {
  {
    const std::lock_guard lock(mutex_);
    stopping_ = true;
  }
  wake_.notify_all();
  if (thread_.joinable()) thread_.join();
}

void Cycle::enqueue(const Request& request) {
  {
    const std::lock_guard lock(mutex_);
    // A Reset is answered at once: a robot could pile them up before a long zero measurement. One is as good
    // as many.
    if (request.kind == CommandKind::reset && std::exchange(reset_waits_, true)) return;
    robot_tasks_.push_back([this, request] { carry_out(request); });
  }
  wake_.notify_all();
}

std::optional<Cycle::Task> Cycle::next_task() {
  std::unique_lock lock(mutex_);
  wake_.wait_for(lock, idle_period,
                 [this] { return stopping_ || !robot_tasks_.empty() || !other_tasks_.empty(); });
  auto& tasks = robot_tasks_.empty() ? other_tasks_ : robot_tasks_;
  if (stopping_ || tasks.empty()) return std::nullopt;
  Task task = std::move(tasks.front());
  tasks.pop_front();
  return task;
}

void Cycle::run() {
  for (;;) {
    last_progress_ = Clock::now();
    refresh();
    const auto task = next_task();
    if (task) (*task)();
    const std::lock_guard lock(mutex_);
    if (!stopping_) continue;
    other_tasks_.clear();  // breaks the promises of those who wait
    return;
  }
}

// Looks at cameras and zero and tells the links and whoever asks for the status.
void Cycle::refresh() {
  end_forgotten_survey();
  const Job& job = cell_.jobs[selected_];
  Status now;
  now.job = job.name;
  now.zero = zeros_[selected_].record;
  now.zero_code = zeros_[selected_].code;
  now.zero_reason = zeros_[selected_].reason;
  now.cameras_known = true;
  for (std::size_t i = 0; i < grabber_.size(); ++i) {
    const CameraWorker& worker = grabber_.camera(i);
    now.cameras.push_back({cell_.cameras[i].name, worker.state(), worker.last_problem(), worker.statistics(),
                           checks_[i], health_[i]});
    now.cameras_known = now.cameras_known && now.cameras[i].state != CameraState::opening;
  }
  CellState cell;
  cell.config_valid = true;
  cell.cameras_alive = std::ranges::all_of(eyes_of(cell_, job), [&](std::size_t eye) {
    return now.cameras[device_of(job, eye, cell_.cameras.size())].state == CameraState::alive;
  });
  cell.zero_valid = now.zero.has_value() || job.gaps;
  cell.camera_moved = a_camera_moved();
  cell.simulated = cell_.simulated;
  cell.config_hash = cell_.config_hash;
  cell.calibration_hash = cell_.calibration_hash;
  cell.zero_id = now.zero ? now.zero->id : 0;
  now.ready = cell.cameras_alive && cell.zero_valid;
  if (cell.camera_moved) now.proposal = proposal_;
  now.last_gaps = last_gaps_;
  for (RobotLink* link : links_) link->set_cell_state(cell);

  const std::lock_guard lock(mutex_);
  for (std::size_t i = 0; i < status_.cameras.size(); ++i)
    if (status_.cameras[i].state != now.cameras[i].state) log_change(now.cameras[i]);
  now.cycles = status_.cycles;
  status_ = std::move(now);
}

void Cycle::forget_checks() {
  trend_ = {};
  moved_.reset();
  proposal_ = {};
  checks_.assign(cell_.cameras.size(), {});
  health_.assign(cell_.cameras.size(), {});
}

bool Cycle::a_camera_moved() const {
  return std::ranges::find(checks_, CameraStand::moved, &CameraCheck::stand) != checks_.end();
}

void Cycle::remember(const ReferenceCheck& check) {
  if (check.cameras.empty()) return;
  trend_ = check.trend;
  for (const CameraCheck& camera : check.cameras) {
    CameraCheck& known = checks_.at(camera.camera);
    if (known.stand != camera.stand)
      spdlog::log(camera.stand == CameraStand::ok ? spdlog::level::info : spdlog::level::warn,
                  "{}: {} by its reference points, displaced by {:.3f} px ({} of {} seen)",
                  cell_.cameras[camera.camera].name, name_of(camera.stand), camera.rms_px, camera.seen,
                  camera.expected);
    known = camera;
  }
}

void Cycle::propose_places() {
  const auto moved = std::exchange(moved_, std::nullopt);
  if (!moved) return;
  const auto& [job, eyes, frames, cameras, measurement] = *moved;
  const auto images = images_of(eyes, frames);
  proposal_ = propose({images, *job, cameras, zeros_[selected_].record->zero, X_O0O_last_, &cell_.references},
                      measurement);
  for (const CameraProposal& camera : proposal_.cameras) log_proposal(cameras[camera.camera], camera);
}

Status Cycle::status() const {
  const std::lock_guard lock(mutex_);
  return status_;
}

void Cycle::carry_out(const Request& request) {
  if (request.kind == CommandKind::reset) {  // the handshake answers it by itself
    {
      const std::lock_guard lock(mutex_);
      reset_waits_ = false;
    }
    X_O0O_last_.reset();
    hands_.forget();
    return refresh();
  }
  Report report;
  try {
    report = report_for(request);
  } catch (const std::exception& error) {
    spdlog::error("request {}: {}", request.id, error.what());
  }
  report.request_id = request.id;
  report.ticket = request.ticket;
  refresh();  // a new zero or job is known to the robot before the answer is
  links_.at(request.robot)->publish(report);
  try {
    propose_places();
  } catch (const std::exception& error) {
    spdlog::error("where the camera is now: {}", error.what());
  }
  const std::lock_guard lock(mutex_);
  ++status_.cycles;
}

Report Cycle::report_for(const Request& request) {
  Report report;
  switch (request.kind) {
    case CommandKind::measure: {
      if (request.job != cell_.jobs[selected_].number) {
        report.code = Code::unknown_job;
        spdlog::warn("request {}: measures job {}, but {} is selected", request.id, request.job,
                     cell_.jobs[selected_].number);
        return report;
      }
      RobotLink& link = *links_.at(request.robot);
      const RobotOptions& robot = cell_.robots.at(request.robot);
      if (const std::string why = not_for(cell_.jobs[selected_], request.robot); !why.empty()) {
        report.code = Code::wrong_position;
        spdlog::warn("{} request {}: {}", robot.name, request.id, why);
        return report;
      }
      const auto outcome = measure(request.part, request.deadline, [&] { link.exposure_done(request.id); });
      hands_.forget();  // every picture counts once, whatever came of it
      const Measurement& m = outcome.measurement;
      report.code = m.code;
      report.effective_marks = m.pose.effective_marks;
      report.effective_cameras = m.pose.effective_cameras;
      report.largest_deviation_mm = m.largest_deviation_mm;
      report.sigma_mm = m.sigma_mm;
      if (m.code == Code::ok && m.gaps)
        report.correction = m.X_O0O;
      else if (m.code == Code::ok)
        report.correction = correction(robot.frame, base_of(robot, request),
                                       zeros_[selected_].record->zero.X_WO0, m.pose.X_WO);
      if (m.code == Code::ok && Clock::now() < request.deadline) X_O0O_last_ = m.X_O0O;
      spdlog::info("{} request {}: code {} {}{}, grab {} us, compute {} us", robot.name, request.id,
                   static_cast<int>(m.code), text_of(m.code).name,
                   m.reason.empty() ? "" : " (" + m.reason + ")", microseconds(outcome.grab),
                   microseconds(outcome.compute));
      return report;
    }
    case CommandKind::zero: {
      // It would forget the movement. An operator may take one, from the command line.
      if (a_camera_moved()) {
        spdlog::warn("request {}: no zero while a camera counts as moved", request.id);
        report.code = Code::camera_moved;
        return report;
      }
      const auto outcome = take_zero(request.part, request.deadline);
      hands_.forget();
      report.code = outcome.code;
      return report;
    }
    case CommandKind::select_job: {
      const auto job = std::find_if(cell_.jobs.begin(), cell_.jobs.end(),
                                    [&](const Job& j) { return j.number == request.job; });
      report.code = job == cell_.jobs.end() ? Code::unknown_job : Code::ok;
      if (job != cell_.jobs.end()) select(static_cast<std::size_t>(job - cell_.jobs.begin()));
      return report;
    }
    case CommandKind::at_position:
      report.code = at_position(request);
      return report;
    default:
      report.code = Code::unknown_command;
      return report;
  }
}

void Cycle::select(std::size_t job) {
  if (job == selected_) return;
  selected_ = job;
  X_O0O_last_.reset();
  last_gaps_.reset();
  hands_.forget();
  forget_checks();
}

MeasureOutcome Cycle::measure(std::optional<std::uint32_t> part, TimePoint deadline,
                              const std::function<void()>& on_exposed) {
  const Job& job = cell_.jobs[selected_];
  MeasureOutcome outcome;
  outcome.job = &job;
  last_gaps_.reset();
  Measurement& m = outcome.measurement;
  const auto& zero = zeros_[selected_].record;
  if (!zero && !job.gaps) {
    m.code = zeros_[selected_].code;
    m.reason = zeros_[selected_].reason;
    return outcome;
  }
  const auto start = Clock::now();
  m.code = Code::position_missing;
  m.reason = hands_.missing(job, part, start);
  if (!m.reason.empty()) return outcome;
  JobPictures grabbed = job_pictures(cell_, job, grabber_, hands_, 0, deadline - compute_reserve);
  const auto computing = Clock::now();
  outcome.grab = computing - start;
  if (grabbed.code != Code::ok) {
    m.code = grabbed.code;
    m.reason = std::move(grabbed.reason);
    return outcome;
  }
  outcome.frames = std::move(grabbed.frames);
  outcome.trigger_spread = grabbed.trigger_spread;
  outcome.device_spread = grabbed.device_spread;
  on_exposed();
  const References* references = cell_.references.views.empty() ? nullptr : &cell_.references;
  const auto images = images_of(grabbed.eyes, outcome.frames);
  const auto cameras = cameras_for(cell_, job, hands_.hands(job));
  static const Zero none;  // gaps need none
  m = zeropose::measure({images, job, cameras, zero ? zero->zero : none, X_O0O_last_, references, &trend_});
  if (m.gaps) last_gaps_ = m;
  remember(m.references);
  proposal_ = {};
  if (m.code == Code::camera_moved) moved_ = {&job, grabbed.eyes, outcome.frames, cameras, m};
  follow_health(health_, images, m, job, cell_);
  for (const std::size_t eye : grabbed.eyes)
    outcome.health.push_back(health_[device_of(job, eye, cell_.cameras.size())]);
  outcome.compute = Clock::now() - computing;
  return outcome;
}

MeasureOutcome Cycle::measure_now() {
  return run_between<MeasureOutcome>([this] {
    MeasureOutcome outcome = measure({}, Clock::now() + cell_.deadline, [] {});
    propose_places();
    if (outcome.measurement.code == Code::camera_moved) outcome.proposal = proposal_;
    return outcome;
  });
}

ZeroOutcome Cycle::zero_now() {
  return run_between<ZeroOutcome>([this] {
    auto outcome = take_zero({}, Clock::now() + cell_.zero_deadline);
    refresh();
    return outcome;
  });
}

Snapshot Cycle::snapshot_now(std::size_t camera) {
  return run_between<Snapshot>([this, camera] { return snapshot(camera); });
}

Snapshot Cycle::snapshot(std::size_t camera) {
  const Job& job = cell_.jobs[selected_];
  const std::size_t cameras[] = {camera};
  Snapshot snapshot{std::move(grabber_.grab(cameras, Clock::now() + cell_.deadline).front()), {}, {}, {}};
  if (snapshot.grabbed.status != GrabStatus::ok) return snapshot;
  find_gaps(camera, snapshot);
  if (job.wheel)
    snapshot.lines = wheel_lines(job, cell_.calibration, camera, view_of(snapshot.grabbed.frame));
  const auto& zero = zeros_[selected_].record;
  const Pose X_WO_expected = zero ? zero->zero.X_WO0 : job.X_WO_nominal;
  const auto calibration = cameras_for(cell_, job);
  const auto searches = job_searches(job, calibration, X_WO_expected);
  const auto findings =
      find_job_marks(images_of(cameras, {&snapshot.grabbed.frame, 1}), job, calibration, X_WO_expected);
  for (std::size_t i = 0; i < job.views.size(); ++i)
    if (job.views[i].camera == camera)
      snapshot.marks.push_back({job.marks[job.views[i].mark].name, searches[i], findings[i]});
  return snapshot;
}

}  // namespace zeropose
