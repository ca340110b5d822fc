// Reads what a job with gaps says, and checks it against its cell. Internal to the room.
#pragma once

#include <vector>

#include "config/cell.h"
#include "config/job_reader.h"

namespace zeropose {

GapTask read_gaps(JsonObject& object, const std::vector<Mounted>& cameras);

// What only shows when the whole cell file is read: names, counts, windows in the images, one hand, the frame
// of its robot.
void check_gaps(const Cell& cell, const Job& job, const std::string& path, JsonReading& reading);

// What only shows with the calibration: every camera sees the plane of its gap.
void check_gap_planes(const Cell& cell, JsonReading& reading);

}  // namespace zeropose
