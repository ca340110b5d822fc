// Reads what a job of a wheel says, and checks it against its cell. Internal to the room.
#pragma once

#include <vector>

#include "config/cell.h"
#include "config/job_reader.h"

namespace zeropose {

// Also the wheel's nominal pose and the limits of the result.
void read_wheel(JsonObject& object, const std::vector<Mounted>& cameras, Job& job);

// What only shows when the whole object is read: three sensors round the wheel, with six cameras.
void check_wheel(const WheelTask& task, const std::string& path, JsonReading& reading);

// What only shows with the calibration: every camera sees its part of the side wall.
void check_wheel_sight(const Cell& cell, JsonReading& reading);

}  // namespace zeropose
