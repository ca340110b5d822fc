// A camera with a thread of its own: opens it, opens it again when it was lost, triggers and grabs on
// request. However long the device blocks, the one who asks waits no longer than the deadline and other
// cameras not at all.
#pragma once

#include <condition_variable>
#include <deque>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <thread>

#include "drivers/camera.h"

namespace zeropose {

enum class GrabStatus {
  missing,     // the camera cannot be reached
  timeout,     // no frame by the deadline
  damaged,     // a frame came incomplete or out of sequence
  wrong_size,  // the camera or a frame has another size than agreed
  ok,
};

struct GrabResult {
  GrabStatus status = GrabStatus::missing;
  Frame frame;         // with status ok only
  std::string reason;  // with every other status: which camera, what happened, what to do
};

enum class CameraState {
  opening,  // the first attempt is still under way
  missing,
  alive,
};

struct CameraWorkerOptions {
  std::chrono::milliseconds check_period{500};   // between signs of life of an idle camera
  std::chrono::milliseconds overdue{1200};       // a call into the device longer than this: missing
  std::chrono::milliseconds first_retry{100};    // after a failed opening, doubled each time
  std::chrono::milliseconds longest_retry{800};  // up to this
  std::chrono::milliseconds in_use_retry{3500};  // after a device that another program controls
  int timeouts_until_reopened = 3;               // in a row, although the device gives signs of life
};

class CameraWorker {
 public:
  using Open = std::function<std::unique_ptr<Camera>(const CameraOptions&)>;

  // Returns at once; the thread opens the camera and tries again until it succeeds.
  explicit CameraWorker(CameraOptions camera, Open open = open_camera, CameraWorkerOptions options = {});
  // Waits for the thread: at once for an idle camera; up to 11 s while a lost device blocks its library. Ask
  // all workers by request_stop() first, then the waits run side by side.
  ~CameraWorker();
  CameraWorker(const CameraWorker&) = delete;
  CameraWorker& operator=(const CameraWorker&) = delete;

  class Pending;
  // Triggers and grabs one frame; never blocks. Requests are served in the order they were made.
  Pending request(TimePoint deadline);

  CameraState state() const;
  // Why it is missing, or the last problem that it had; empty: none yet.
  std::string last_problem() const;
  CameraStatistics statistics() const;  // over all openings
  const CameraOptions& camera() const { return camera_; }
  void request_stop();

 private:
  struct Request;
  class Call;

  void run(const std::stop_token& stop);
  void serve(Camera& camera, const std::stop_token& stop);
  std::unique_ptr<Camera> open();
  std::shared_ptr<Request> next_request(const std::stop_token& stop);
  void answer(Camera& camera, Request& request);
  void check(Camera& camera);
  void lose(const std::string& reason, GrabStatus status);
  void wait_to_retry(const std::stop_token& stop, std::chrono::milliseconds wait);
  CameraState state_locked(TimePoint now) const;

  const CameraOptions camera_;
  const Open open_;
  const CameraWorkerOptions options_;

  mutable std::mutex mutex_;
  std::condition_variable_any wake_;
  std::deque<std::shared_ptr<Request>> requests_;
  bool open_now_ = false;
  bool tried_ = false;    // the first opening has ended
  TimePoint call_due_{};  // when the call under way must have returned; max(): none
  GrabStatus lost_as_ = GrabStatus::missing;
  std::string last_problem_;
  CameraStatistics closed_, current_;

  int timeouts_ = 0;  // in a row; of the thread only
  std::jthread thread_;
};

// One request on its way. Must not outlive the worker.
class CameraWorker::Pending {
 public:
  // The frame or a reason, by the deadline at the latest; what comes later is dropped. Call once.
  GrabResult wait();

 private:
  friend class CameraWorker;
  Pending(const CameraWorker& worker, std::shared_ptr<Request> request);

  const CameraWorker* worker_;
  std::shared_ptr<Request> request_;
};

}  // namespace zeropose
