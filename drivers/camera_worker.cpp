#include "drivers/camera_worker.h"

#include <algorithm>
#include <optional>
#include <utility>

namespace zeropose {
namespace {

using std::chrono::steady_clock;

GrabStatus status_of(DeviceFault fault) {
  switch (fault) {
    case DeviceFault::damaged_frame:
      return GrabStatus::damaged;
    case DeviceFault::wrong_size:
      return GrabStatus::wrong_size;
    case DeviceFault::missing:
    case DeviceFault::in_use:
      break;
  }
  return GrabStatus::missing;
}

GrabResult refusal(GrabStatus status, std::string reason) {
  GrabResult result;
  result.status = status;
  result.reason = std::move(reason);
  return result;
}

}  // namespace

// Shared by the one who asks and the thread.
struct CameraWorker::Request {
  explicit Request(TimePoint until) : deadline(until) {}

  void fulfil(GrabResult answer) {
    const std::lock_guard lock(mutex);
    if (result) return;
    result = std::move(answer);
    done.notify_all();
  }

  const TimePoint deadline;
  std::mutex mutex;
  std::condition_variable done;
  std::optional<GrabResult> result;
};

// Marks a call into the device, so that others see when it takes too long.
class CameraWorker::Call {
 public:
  Call(CameraWorker& worker, TimePoint due) : worker_(worker) { set(due); }
  ~Call() { set(TimePoint::max()); }
  Call(const Call&) = delete;
  Call& operator=(const Call&) = delete;

 private:
  void set(TimePoint due) {
    const std::lock_guard lock(worker_.mutex_);
    worker_.call_due_ = due;
  }
  CameraWorker& worker_;
};

CameraWorker::Pending::Pending(const CameraWorker& worker, std::shared_ptr<Request> request)
    : worker_(&worker), request_(std::move(request)) {}

GrabResult CameraWorker::Pending::wait() {
  {
    std::unique_lock lock(request_->mutex);
    request_->done.wait_until(lock, request_->deadline, [this] { return request_->result.has_value(); });
    if (request_->result) return std::move(*request_->result);
  }
  if (worker_->state() != CameraState::alive) return refusal(GrabStatus::missing, worker_->last_problem());
  return refusal(GrabStatus::timeout, title_of(worker_->camera_) + ": no frame by the deadline");
}

CameraWorker::CameraWorker(CameraOptions camera, Open open, CameraWorkerOptions options)
    : camera_(std::move(camera)),
      open_(std::move(open)),
      options_(options),
      call_due_(steady_clock::now() + options.overdue),
      last_problem_(title_of(camera_) + ": not opened yet"),
      thread_([this](const std::stop_token& stop) { run(stop); }) {}

CameraWorker::~CameraWorker() {
  thread_.request_stop();
  thread_.join();
}

void CameraWorker::request_stop() { thread_.request_stop(); }

CameraState CameraWorker::state_locked(TimePoint now) const {
  if (now > call_due_) return CameraState::missing;
  if (open_now_) return CameraState::alive;
  return tried_ ? CameraState::missing : CameraState::opening;
}

CameraState CameraWorker::state() const {
  const std::lock_guard lock(mutex_);
  return state_locked(steady_clock::now());
}

std::string CameraWorker::last_problem() const {
  const std::lock_guard lock(mutex_);
  if (open_now_ && steady_clock::now() > call_due_)
    return title_of(camera_) +
           ": does not answer; check its power and cable. It is used again as soon as it answers";
  return last_problem_;
}

CameraStatistics CameraWorker::statistics() const {
  const std::lock_guard lock(mutex_);
  return closed_ + current_;
}

CameraWorker::Pending CameraWorker::request(TimePoint deadline) {
  auto request = std::make_shared<Request>(deadline);
  bool accepted = false;
  GrabStatus refused_as = GrabStatus::missing;
  {
    const std::lock_guard lock(mutex_);
    accepted = state_locked(steady_clock::now()) == CameraState::alive;
    if (accepted) requests_.push_back(request);
    if (!open_now_) refused_as = lost_as_;
  }
  if (accepted)
    wake_.notify_all();
  else
    request->fulfil(refusal(refused_as, last_problem()));
  return {*this, std::move(request)};
}

void CameraWorker::run(const std::stop_token& stop) {
  std::chrono::milliseconds retry = options_.first_retry;
  while (!stop.stop_requested()) {
    std::unique_ptr<Camera> camera;
    bool in_use = false;
    try {
      camera = open();
      retry = options_.first_retry;
      serve(*camera, stop);
    } catch (const DeviceError& error) {
      lose(error.what(), status_of(error.fault()));
      in_use = error.fault() == DeviceFault::in_use;
    } catch (const std::exception& error) {
      lose(title_of(camera_) + ": " + error.what(), GrabStatus::missing);
    }
    camera.reset();
    wait_to_retry(stop, in_use ? options_.in_use_retry : retry);
    retry = std::min(2 * retry, options_.longest_retry);
  }
  lose(title_of(camera_) + ": stopped", GrabStatus::missing);
}

std::unique_ptr<Camera> CameraWorker::open() {
  std::unique_ptr<Camera> camera = open_(camera_);
  camera->start();
  const std::lock_guard lock(mutex_);
  if (!tried_) last_problem_.clear();
  open_now_ = tried_ = true;
  call_due_ = TimePoint::max();
  timeouts_ = 0;
  return camera;
}

void CameraWorker::lose(const std::string& reason, GrabStatus status) {
  std::deque<std::shared_ptr<Request>> waiting;
  {
    const std::lock_guard lock(mutex_);
    open_now_ = false;
    tried_ = true;
    call_due_ = TimePoint::max();
    lost_as_ = status;
    last_problem_ = reason;
    closed_ = closed_ + std::exchange(current_, {});
    waiting.swap(requests_);
  }
  for (const auto& request : waiting) request->fulfil(refusal(status, reason));
}

void CameraWorker::wait_to_retry(const std::stop_token& stop, std::chrono::milliseconds wait) {
  std::unique_lock lock(mutex_);
  wake_.wait_for(lock, stop, wait, [] { return false; });
}

std::shared_ptr<CameraWorker::Request> CameraWorker::next_request(const std::stop_token& stop) {
  std::unique_lock lock(mutex_);
  wake_.wait_for(lock, stop, options_.check_period, [this] { return !requests_.empty(); });
  if (requests_.empty()) return nullptr;
  auto request = std::move(requests_.front());
  requests_.pop_front();
  return request;
}

void CameraWorker::serve(Camera& camera, const std::stop_token& stop) {
  while (!stop.stop_requested()) {
    const auto request = next_request(stop);
    if (stop.stop_requested()) return;
    if (!request)
      check(camera);
    else if (steady_clock::now() < request->deadline)
      answer(camera, *request);
    const std::lock_guard lock(mutex_);
    current_ = camera.statistics();
  }
}

void CameraWorker::check(Camera& camera) {
  const Call call(*this, steady_clock::now() + options_.overdue);
  camera.check();
}

void CameraWorker::answer(Camera& camera, Request& request) {
  GrabResult result;
  try {
    const Call call(*this, request.deadline + options_.overdue);
    camera.trigger();
    if (std::optional<Frame> frame = camera.grab(request.deadline)) {
      timeouts_ = 0;
      result.status = GrabStatus::ok;
      result.frame = std::move(*frame);
      request.fulfil(std::move(result));
      return;
    }
    ++timeouts_;
    result = refusal(GrabStatus::timeout, title_of(camera_) + ": no frame by the deadline");
  } catch (const DeviceError& error) {
    result = refusal(status_of(error.fault()), error.what());
  }
  const std::string reason = result.reason;
  const bool lost = result.status == GrabStatus::missing || timeouts_ >= options_.timeouts_until_reopened;
  {
    const std::lock_guard lock(mutex_);
    last_problem_ = reason;
  }
  request.fulfil(std::move(result));
  if (lost) throw DeviceError(reason);
  check(camera);
}

}  // namespace zeropose
