#include "daemon/survey_json.h"

#include <algorithm>
#include <array>
#include <stdexcept>

#include "daemon/pose_json.h"
#include "protocol/codec.h"

namespace zeropose {
namespace {

using Json = nlohmann::json;

std::size_t camera_index(const Cell& cell, const std::string& name) {
  const auto found = std::ranges::find(cell.cameras, name, &CameraOptions::name);
  if (found == cell.cameras.end()) throw std::invalid_argument("the cell has no camera \"" + name + "\"");
  return static_cast<std::size_t>(found - cell.cameras.begin());
}

RoundTarget round_target(MarkKind kind, const Json& target) {
  MarkSearch search;
  search.kind = kind;
  search.bright = target.value("bright", false);
  search.min_diameter_px = target.at("min_diameter_px").get<double>();
  search.max_diameter_px = target.at("max_diameter_px").get<double>();
  if (!(search.min_diameter_px > 0 && search.max_diameter_px > search.min_diameter_px))
    throw std::invalid_argument("the least diameter must be above 0 and below the largest, px");
  return {search};
}

BoardTarget board_target(const std::string& kind, const Json& target) {
  BoardProblem problem;
  const auto kinds = {BoardKind::circles, BoardKind::asymmetric_circles, BoardKind::chessboard};
  const auto found = std::ranges::find_if(kinds, [&](BoardKind one) { return kind == name_of(one); });
  if (found == kinds.end())
    throw std::invalid_argument(
        "no target \"" + kind +
        "\"; there are ball, disc, body, touch, circles, asymmetric-circles, chessboard");
  problem.kind = *found;
  problem.rows = target.at("rows").get<int>();
  problem.cols = target.at("cols").get<int>();
  problem.pitch_mm = target.at("pitch_mm").get<double>();
  return {problem, target.value("diameter_mm", 0.0) / 2};
}

Eigen::Vector3d vector(const Json& three) {
  const auto numbers = three.get<std::array<double, 3>>();
  return {numbers[0], numbers[1], numbers[2]};
}

// The internals that the cell believes are about right.
BodyTarget body_target(const CameraModel& camera, const Json& marks) {
  BodyTarget target;
  for (const Json& mark : marks)
    target.marks.push_back({mark.at("name").get<std::string>(), vector(mark.at("p_B_mm")),
                            mark.at("radius_mm").get<double>(), vector(mark.at("normal_B"))});
  target.problem.camera = camera;
  return target;
}

Json point_json(const SurveyPoint& point) {
  const Eigen::Matrix2d& S = point.covariance_px2;
  const Eigen::Vector3d& n = point.normal_B;
  return {{"camera", point.camera},
          {"x_mm", point.p_B_mm.x()},
          {"y_mm", point.p_B_mm.y()},
          {"z_mm", point.p_B_mm.z()},
          {"u_px", point.u_px.x()},
          {"v_px", point.u_px.y()},
          {"suu", S(0, 0)},
          {"svv", S(1, 1)},
          {"suv", S(0, 1)},
          {"radius_mm", point.radius_mm},
          {"nx", n.x()},
          {"ny", n.y()},
          {"nz", n.z()}};
}

std::size_t driven_robot(const Cell& cell, const std::string& name) {
  const auto found = std::ranges::find(cell.robots, name, &RobotOptions::name);
  if (found == cell.robots.end()) throw std::invalid_argument("the cell has no robot \"" + name + "\"");
  if (!std::holds_alternative<ModbusTcpOptions>(found->link) &&
      !std::holds_alternative<ModbusRtuOptions>(found->link))
    throw std::invalid_argument("robot " + name +
                                " cannot be told where to go: only a Modbus server's registers carry it");
  return static_cast<std::size_t>(found - cell.robots.begin());
}

std::vector<Pose> targets_of(const RobotOptions& robot, const Json& poses) {
  std::vector<Pose> targets;
  for (const Json& pose : poses) {
    const auto s = pose.get<std::array<double, 6>>();
    targets.push_back(from_six_numbers({s[0], s[1], s[2], s[3], s[4], s[5]}));
    if (!to_wire(robot.convention, targets.back()))
      throw std::invalid_argument("target " + std::to_string(targets.size()) +
                                  " has numbers that the robot's registers cannot carry");
  }
  return targets;
}

}  // namespace

SurveyOptions survey_options(const Cell& cell, const Json& question) {
  SurveyOptions options;
  for (const auto& name : question.at("cameras").get<std::vector<std::string>>())
    options.cameras.push_back({camera_index(cell, name), name});
  options.positions = question.at("positions").get<int>();
  const Json& target = question.at("target");
  const auto kind = target.at("kind").get<std::string>();
  if (options.cameras.empty() && kind != "touch") throw std::invalid_argument("no camera is named");
  if (kind == "touch")
    options.target = TouchTarget{};
  else if (kind == "ball")
    options.target = round_target(MarkKind::ball, target);
  else if (kind == "disc")
    options.target = round_target(MarkKind::disc, target);
  else if (kind == "body")
    options.target =
        body_target(cell.calibration.at(options.cameras.front().index).model, target.at("marks"));
  else
    options.target = board_target(kind, target);
  if (!question.contains("targets")) return options;
  options.robot = driven_robot(cell, question.at("robot").get<std::string>());
  options.targets = targets_of(cell.robots[options.robot], question.at("targets"));
  return options;
}

Json survey_json(const SurveyState& state) {
  Json json{{"status", "ok"},
            {"survey", state.number},
            {"positions", 0},
            {"missing", Json::array()},
            {"last_problem", state.last_problem},
            {"views", Json::array()}};
  if (!state.survey) return json;
  json["positions"] = state.survey->options().positions;
  json["missing"] = state.survey->missing();
  for (const auto& [position, view] : state.survey->views()) {
    Json points = Json::array();
    for (const SurveyPoint& point : view.points) points.push_back(point_json(point));
    json["views"].push_back(
        {{"position", position}, {"X_RH", six_json(view.X_RH)}, {"points", std::move(points)}});
  }
  return json;
}

}  // namespace zeropose
