#include <algorithm>
#include <memory>
#include <optional>
#include <sstream>

#include "calib/tool.h"
#include "config/robot_tables.h"
#include "daemon/cli/answer.h"
#include "daemon/cli/calibrate.h"
#include "daemon/cli/convert.h"
#include "daemon/cli/output.h"
#include "daemon/cli/robot_answer.h"
#include "daemon/cli/robot_report.h"

namespace zeropose {
namespace {

using namespace cli;

constexpr const char* calibrate_tool_help =
    R"(The tool's end touches one fixed point from several orientations; p_HT is the end in the hand's frame.
touches.csv: columns x_mm y_mm z_mm rx_deg ry_deg rz_deg, the hand's pose X_RH (flange, no tool set in the robot) at each
touch, R = Rz(rz) Ry(ry) Rx(rx) (zeropose convert pose for other conventions); optional touch, a name.
At least 3 touches with turns about two axes across each other; better 5 and more, tilted by 30 degrees and more to
different sides. Turns about one axis leave the end open along it: the reason names the axis.
A touch that contradicts the others is left out and named when it is clear which one; else the candidates are named.
The covariances are enlarged where few touches have to tell their own noise: 95 % ellipsoids hold the truth in 95 %.
Example:
  zeropose calibrate tool --touches touches.csv --json
Exit status: 0 done, 1 the touches cannot give an answer (status and reason say why), 2 wrong usage or
unreadable input.)";

struct ToolOptions {
  std::string touches, report;
  std::optional<std::string> active;
  double sigma_mm = 0;
  bool json = false;
};

Json names_json(const std::vector<HandPose>& touches, const std::vector<std::size_t>& which) {
  Json names = Json::array();
  for (const std::size_t touch : which) names.push_back(touches[touch].name);
  return names;
}

Json residuals_json(const std::vector<HandPose>& touches, const ToolResult& result) {
  Json residuals = Json::array();
  for (std::size_t i = 0; i < result.residuals_mm.size(); ++i)
    residuals.push_back({{"touch", touches[i].name},
                         {"residual_mm", json_of(result.residuals_mm[i])},
                         {"distance_mm", result.residuals_mm[i].norm()},
                         {"used", std::ranges::find(result.removed, i) == result.removed.end()}});
  return residuals;
}

Json tool_json(const std::vector<HandPose>& touches, const ToolResult& result) {
  const bool good = result.status == ToolStatus::ok;
  Json json = {{"status", good ? "ok" : "failed"}, {"reason", result.reason}};
  json["what"] = name_of(result.status);
  json["p_HT"] = good ? json_of(result.p_HT_mm) : Json();
  json["fixed_point"] = good ? json_of(result.p_RT_mm) : Json();
  json["sigma"] = good ? json_of(Eigen::Vector3d(result.covariance.diagonal().cwiseSqrt())) : Json();
  json["covariance"] = good ? rows_json(result.covariance) : Json();
  json["sigma_mm"] = result.sigma_mm;
  json["rms_mm"] = result.rms_mm;
  json["redundancy"] = result.redundancy;
  json["residuals_mm"] = residuals_json(touches, result);
  json["removed"] = names_json(touches, result.removed);
  json["suspects"] = names_json(touches, result.suspects);
  if (result.status == ToolStatus::rotation_missing) add_open_axes(result.turns, json);
  json["warnings"] = result.warnings;
  return json;
}

std::string tool_text(const std::vector<HandPose>& touches, const ToolResult& result) {
  if (result.status != ToolStatus::ok)
    return "no answer: " + result.reason + "\n" + warnings_text(result.warnings);
  const Eigen::Vector3d sigma = result.covariance.diagonal().cwiseSqrt();
  std::ostringstream text;
  text << "p_HT, the tool's end in the hand, mm:\n"
       << table_of({result.p_HT_mm.data(), 3}) << "\nsigma:\n"
       << table_of({sigma.data(), 3}) << "\nthe point in the robot's base, mm:\n"
       << table_of({result.p_RT_mm.data(), 3}) << "\nresiduals, mm (" << result.rms_mm << " mm rms):\n";
  for (std::size_t i = 0; i < touches.size(); ++i)
    text << table_of({result.residuals_mm[i].data(), 3}) << "  " << touches[i].name
         << (std::ranges::find(result.removed, i) == result.removed.end()
                 ? ""
                 : "  left out: it contradicts the others")
         << "\n";
  return text.str() + warnings_text(result.warnings);
}

Answer calibrate_tool_of(const ToolOptions& options) {
  const std::vector<HandPose> touches = load_hand_poses(options.touches, "touch", false);
  std::optional<Eigen::Vector3d> active_mm;
  if (options.active) active_mm = place_of_option(*options.active, "--active");
  std::vector<Pose> X_RH;
  for (const HandPose& touch : touches) X_RH.push_back(touch.X_RH);
  ToolProblem problem;
  problem.X_RH = X_RH;
  problem.sigma_mm = options.sigma_mm;
  const ToolResult result = calibrate_tool(problem);
  const bool good = result.status == ToolStatus::ok;
  Answer answer{good ? done : no_answer, tool_json(touches, result), tool_text(touches, result)};
  if (good && !options.report.empty())
    write_page(options.report, tool_report(touches, result, active_mm, "Touches: " + options.touches),
               answer);
  return answer;
}

}  // namespace

void add_calibrate_tool(cli::Verb calibrate, int& exit_status) {
  auto options = std::make_shared<ToolOptions>();
  const Verb verb =
      calibrate.add_subcommand("tool", "The end of a robot's tool from touches of a fixed point");
  verb.add_option("--touches", options->touches,
                  "CSV: [touch] x_mm y_mm z_mm rx_deg ry_deg rz_deg, the hand's pose X_RH per touch")
      .required();
  verb.add_option("--sigma-mm", options->sigma_mm,
                  "of one coordinate of a touch; without it from the residuals")
      .range(1e-6, 100.0);
  const VerbOption report =
      verb.add_option("--report", options->report, "the report as a page (SVG) to write");
  verb.add_option("--active", options->active, "X,Y,Z of the tool in use, for the report to compare with")
      .needs(report);
  verb.add_flag(
      "--json", options->json,
      "one JSON object on stdout: status, reason, p_HT, fixed_point, residuals_mm, sigma, covariance (3x3,\n"
      "mm^2), rms_mm, removed, suspects, warnings");
  verb.footer(calibrate_tool_help);
  verb.callback([options, &exit_status] {
    exit_status = run([&] { return calibrate_tool_of(*options); }, options->json);
  });
}

}  // namespace zeropose
