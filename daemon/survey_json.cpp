#include "daemon/survey_json.h"

#include <algorithm>
#include <stdexcept>

#include "daemon/pose_json.h"

namespace zeropose {
namespace {

using Json = nlohmann::json;

std::size_t camera_index(const Cell& cell, const std::string& name) {
  const auto found = std::ranges::find(cell.cameras, name, &CameraOptions::name);
  if (found == cell.cameras.end()) throw std::invalid_argument("the cell has no camera \"" + name + "\"");
  return static_cast<std::size_t>(found - cell.cameras.begin());
}

BallTarget ball_target(const Json& target) {
  MarkSearch search;
  search.kind = MarkKind::ball;
  search.bright = target.value("bright", false);
  search.min_diameter_px = target.at("min_diameter_px").get<double>();
  search.max_diameter_px = target.at("max_diameter_px").get<double>();
  if (!(search.min_diameter_px > 0 && search.max_diameter_px > search.min_diameter_px))
    throw std::invalid_argument("the ball's least diameter must be above 0 and below its largest, px");
  return {search};
}

BoardTarget board_target(const std::string& kind, const Json& target) {
  BoardProblem problem;
  const auto kinds = {BoardKind::circles, BoardKind::asymmetric_circles, BoardKind::chessboard};
  const auto found = std::ranges::find_if(kinds, [&](BoardKind one) { return kind == name_of(one); });
  if (found == kinds.end())
    throw std::invalid_argument("no target \"" + kind +
                                "\"; there are ball, circles, asymmetric-circles, chessboard");
  problem.kind = *found;
  problem.rows = target.at("rows").get<int>();
  problem.cols = target.at("cols").get<int>();
  problem.pitch_mm = target.at("pitch_mm").get<double>();
  return {problem};
}

Json point_json(const SurveyPoint& point) {
  const Eigen::Matrix2d& S = point.covariance_px2;
  return {{"x_mm", point.p_B_mm.x()}, {"y_mm", point.p_B_mm.y()},
          {"z_mm", point.p_B_mm.z()}, {"u_px", point.u_px.x()},
          {"v_px", point.u_px.y()},   {"suu", S(0, 0)},
          {"svv", S(1, 1)},           {"suv", S(0, 1)}};
}

}  // namespace

SurveyOptions survey_options(const Cell& cell, const Json& question) {
  SurveyOptions options;
  options.camera = camera_index(cell, question.at("camera").get<std::string>());
  options.positions = question.at("positions").get<int>();
  const Json& target = question.at("target");
  const auto kind = target.at("kind").get<std::string>();
  if (kind == "ball")
    options.target = ball_target(target);
  else
    options.target = board_target(kind, target);
  return options;
}

Json survey_json(const SurveyState& state) {
  Json json{{"status", "ok"},
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
