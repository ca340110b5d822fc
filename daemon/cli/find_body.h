// The verb find-body: a picture of a calibration body to numbered points (spec 40 P3), and what calibrate
// body needs of it.
#pragma once

#include <string>
#include <vector>

#include "calib/calibration.h"
#include "daemon/cli/answer.h"
#include "daemon/cli/verb.h"
#include "measure/body.h"

namespace zeropose {

void add_find_body(cli::Verb app, int& exit_status);

namespace cli {

struct BodyOptions {
  std::string image, body, camera, camera_name, overlay;
  double focal_px = 0, radius_mm = 0;
};

struct FoundBody {
  std::vector<BodyMark> marks;
  BodyResult result;
  int width_px = 0, height_px = 0;
};

// --focal-px, --camera, --radius-mm and --overlay.
void add_body_options(cli::Verb verb, BodyOptions& options);

// Reads the files, and writes the overlay. Throws ConfigError, std::invalid_argument.
FoundBody find_body_in(const BodyOptions& options);

// status, reason and all that spec 92 says of find-body.
Json body_json(const FoundBody& found);

std::vector<CalibrationPoint> calibration_points(const FoundBody& found);

}  // namespace cli
}  // namespace zeropose
