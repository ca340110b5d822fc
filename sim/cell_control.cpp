#include "sim/cell_control.h"

#include <array>
#include <cmath>
#include <functional>
#include <map>
#include <nlohmann/json.hpp>
#include <sstream>
#include <stdexcept>

namespace zeropose {
namespace {

using Json = nlohmann::json;
using std::invalid_argument;

Json to_json(const Pose& X_AB) {
  const SixNumbers s = to_six_numbers(X_AB);
  return {s.x_mm, s.y_mm, s.z_mm, s.rx_deg, s.ry_deg, s.rz_deg};
}

Pose pose_from(const std::array<double, 6>& s) {
  for (const double number : s)
    if (!std::isfinite(number)) throw invalid_argument("a pose needs six finite numbers");
  return from_six_numbers({s[0], s[1], s[2], s[3], s[4], s[5]});
}

std::string text(const Json& question, const char* key) {
  const auto found = question.find(key);
  if (found == question.end() || !found->is_string())
    throw invalid_argument("'" + std::string(key) + "' is missing or no text");
  return *found;
}

double number(const Json& question, const char* key, double otherwise) {
  const auto found = question.find(key);
  if (found == question.end()) return otherwise;
  if (!found->is_number()) throw invalid_argument("'" + std::string(key) + "' is no number");
  return *found;
}

Pose pose(const Json& question) {
  const auto found = question.find("pose");
  if (found == question.end() || !found->is_array() || found->size() != 6)
    throw invalid_argument("'pose' must be [x, y, z, rx, ry, rz], mm and degrees");
  std::array<double, 6> six{};
  for (std::size_t i = 0; i < six.size(); ++i) {
    if (!(*found)[i].is_number()) throw invalid_argument("'pose' has something that is no number");
    six[i] = (*found)[i];
  }
  return pose_from(six);
}

void shift(SimulatedCell& cell, const Json& question) {
  cell.show(cell.scene().X_WO_nominal * pose(question));
}

void move_hand(SimulatedCell& cell, const Json& question) {
  const double robot = number(question, "robot", 1);
  if (!(robot >= 1)) throw invalid_argument("'robot' counts from 1, in the order of the cell file");
  cell.move_hand(static_cast<std::size_t>(robot) - 1, pose(question));
}

// Without a pose by 0.05 degrees about its y axis.
void move_camera(SimulatedCell& cell, const Json& question) {
  const Pose X_CoCn = question.contains("pose") ? pose(question) : from_six_numbers({0, 0, 0, 0, 0.05, 0});
  cell.move_camera(text(question, "camera"), X_CoCn);
}

Json truth(const SimulatedCell& cell) {
  const Pose X_WO = cell.pose();
  Json cameras = Json::object();
  for (const CalibratedCamera& camera : cell.scene().cameras)
    cameras[camera.name] = cell.camera_runs(camera.name) ? "running" : "dead";
  const Faults faults = cell.faults();
  return {{"status", "ok"},
          {"X_WO", to_json(X_WO)},
          {"X_O0O", to_json(cell.scene().X_WO_nominal.inverse() * X_WO)},
          {"cameras", cameras},
          {"covered", faults.covered},
          {"displaced_px", faults.displaced_px}};
}

void fault(SimulatedCell& cell, const Json& question) {
  const std::map<std::string, std::function<void()>> kinds = {
      {"camera-dead", [&] { cell.stop_camera(text(question, "camera")); }},
      {"camera-back", [&] { cell.start_camera(text(question, "camera")); }},
      {"camera-moved", [&] { move_camera(cell, question); }},
      {"lose-packets", [&] { cell.lose_packets(text(question, "camera"), number(question, "ratio", 0.01)); }},
      {"cover-mark", [&] { cell.cover_mark(text(question, "mark")); }},
      {"wrong-mark", [&] { cell.displace_mark(text(question, "mark"), number(question, "px", 20)); }},
      {"clear", [&] { cell.clear_faults(); }}};
  const std::string kind = text(question, "kind");
  const auto found = kinds.find(kind);
  if (found == kinds.end()) {
    std::string known;
    for (const auto& [name, action] : kinds) known += (known.empty() ? "" : ", ") + name;
    throw invalid_argument("no fault '" + kind + "'; there are: " + known);
  }
  found->second();
}

Json answer(SimulatedCell& cell, const Json& question) {
  if (!question.is_object()) throw invalid_argument("not a JSON object");
  const std::string command = text(question, "cmd");
  if (command == "truth") return truth(cell);
  if (command == "shift")
    shift(cell, question);
  else if (command == "hand")
    move_hand(cell, question);
  else if (command == "fault")
    fault(cell, question);
  else
    throw invalid_argument("no command '" + command + "'; there are: shift, hand, truth, fault");
  return {{"status", "ok"}};
}

}  // namespace

std::string answer_cell_control(SimulatedCell& cell, const std::string& line) {
  try {
    return answer(cell, Json::parse(line)).dump();
  } catch (const std::exception& error) {
    return Json{{"status", "failed"}, {"reason", error.what()}}.dump(-1, ' ', false,
                                                                     Json::error_handler_t::replace);
  }
}

void set_fault(SimulatedCell& cell, const std::string& text_of_fault) {
  const std::size_t colon = text_of_fault.find(':');
  Json question = {{"kind", text_of_fault.substr(0, colon)}};
  if (colon != std::string::npos) {
    const std::string name = text_of_fault.substr(colon + 1);
    question["camera"] = name;
    question["mark"] = name;
  }
  fault(cell, question);
}

Pose pose_from_text(const std::string& text_of_pose) {
  std::string spaced = text_of_pose;
  for (char& c : spaced)
    if (c == ',') c = ' ';
  std::istringstream stream(spaced);
  std::array<double, 6> six{};
  for (double& one : six)
    if (!(stream >> one)) throw invalid_argument("'" + text_of_pose + "' is not x,y,z,rx,ry,rz");
  std::string rest;
  if (stream >> rest) throw invalid_argument("'" + text_of_pose + "' has more than six numbers");
  return pose_from(six);
}

}  // namespace zeropose
