// Reads jobs and what marks and reference points have in common from a cell file. Internal to the room.
#pragma once

#include <string>
#include <vector>

#include "config/json_reader.h"
#include "measure/job.h"

namespace zeropose {

inline constexpr double largest_coordinate_mm = 1e6;

// A camera and the name of the robot that carries it; empty: it is fixed.
struct Mounted {
  std::string camera, robot;
};

// What a mark can be seen from, in the order of View::camera: fixed cameras, and positions by their name,
// which stands for every camera of the position. Cameras on a hand have no name there.
using Eyes = std::vector<std::string>;
Eyes fixed_eyes(const std::vector<Mounted>& cameras);

// The cameras of a mark by name; indices are found once the file is read.
struct NamedMark {
  Mark mark;
  std::vector<std::string> cameras;
};

// What a mark and a reference point have in common.
NamedMark read_look(JsonObject& object);

// Turns the names of the cameras of the mark of this index into views.
void add_views(JsonObject& object, const NamedMark& named, const Eyes& eyes, std::size_t index,
               std::vector<View>& views);

// A direction of length 1 within 1 %, then exactly 1.
void take_direction(JsonObject& object, std::string_view key, const Eigen::Vector3d& given,
                    Eigen::Vector3d& direction);

Job read_job(JsonObject& object, const std::vector<Mounted>& cameras);

}  // namespace zeropose
