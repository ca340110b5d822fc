// Cameras at work for some time: what was counted and measured, and whether it will do.
#pragma once

#include <chrono>
#include <functional>
#include <string>
#include <vector>

#include "daemon/grab.h"
#include "measure/picture_health.h"

namespace zeropose {

struct CameraTrialOptions {
  std::chrono::milliseconds duration{60000};
  double rate_hz = 5;                       // requests per second, to all cameras at once
  std::chrono::milliseconds deadline{500};  // of each request
  std::chrono::seconds patience{15};        // for the cameras to be there
};

// One property of one camera (or of all, without a name) against its limit.
struct TrialFinding {
  std::string camera, what;
  double found = 0, wanted = 0;
  bool good = false;
  std::string remedy;  // what to do if it is not good
};

struct CameraTrial {
  struct Camera {
    std::string name;
    int asked = 0, answered = 0;
    std::vector<double> latency_ms;  // from the request to the frame, of those answered
    std::vector<PictureHealth> health;
    std::string last_problem;
    CameraStatistics statistics;
  };
  std::vector<Camera> cameras;
  double rate_hz = 0;             // rounds per second, reached
  std::vector<double> spread_ms;  // between the cameras' triggers, of each round that all answered
  std::vector<TrialFinding> findings;
  bool good() const;
};

// Sees every frame as it comes; false: no more of them.
using OnFrame = std::function<bool(const Frame& frame, double latency_ms, const PictureHealth& health)>;
// Asks all cameras at once, again and again, and judges. A picture that repeats the one before counts as no
// answer.
CameraTrial try_cameras(const std::vector<CameraOptions>& cameras, const CameraTrialOptions& options,
                        const OnFrame& on_frame = {});

// The share-th quantile, 0..1, of values in any order; 0 of none.
double quantile_of(std::vector<double> values, double share);

}  // namespace zeropose
