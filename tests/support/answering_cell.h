// A robot's endpoint with a cell that is always ready and a cycle that answers by the job's number, watched
// by a recorder: for the programs that peers in other languages play against.
//   job 1: the correction below     job 2: not ok, code 301     job 3: silence, so the time-out
//   job 4: a correction that an int16 of CAN cannot carry       Zero: done, with zero id 0x0A0B0C0D
#pragma once

#include <condition_variable>
#include <deque>
#include <mutex>
#include <thread>

#include "protocol/robot_endpoint.h"
#include "tests/support/recorder.h"

namespace zeropose {

struct AnsweringCellOptions {
  std::chrono::milliseconds to_exposure{100}, to_answer{100};  // the answer comes after both
  std::chrono::milliseconds validity{2000}, measure_deadline{2000};
};

class AnsweringCell {
 public:
  // A robot of convention kuka, frame 3, index 2.
  explicit AnsweringCell(const AnsweringCellOptions& options);
  ~AnsweringCell();
  AnsweringCell(const AnsweringCell&) = delete;
  AnsweringCell& operator=(const AnsweringCell&) = delete;

  RobotEndpoint& endpoint() { return endpoint_; }
  // The exit status of the program: 0 when no wrong valid result was published; else they are on stderr. To
  // be called when nothing brings commands any more.
  int finish();

 private:
  EndpointOptions endpoint_options();
  void take(const Request& request);
  void run();
  void answer(const Request& request);

  const AnsweringCellOptions options_;
  CellState state_{true, true, true, true, 0x01020304, 0x05060708, 0x09090909};
  Recorder recorder_;
  std::mutex mutex_;
  std::condition_variable came_;
  std::deque<Request> requests_;
  bool stopping_ = false;
  RobotEndpoint endpoint_;
  std::thread thread_;
};

}  // namespace zeropose
