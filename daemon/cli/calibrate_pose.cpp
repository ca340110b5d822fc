#include <memory>
#include <optional>
#include <sstream>

#include "calib/pose_only.h"
#include "config/calibration_tables.h"
#include "config/camera_file.h"
#include "config/csv.h"
#include "daemon/cli/answer.h"
#include "daemon/cli/calibrate.h"
#include "daemon/cli/convert.h"
#include "daemon/cli/output.h"
#include "daemon/cli/place_report.h"

namespace zeropose {
namespace {

using namespace cli;

constexpr const char* calibrate_pose_help =
    R"(The pose of a camera whose internals are known from the laboratory. Three ways:
  framework         3 points and more on the housing, not on a line: --feature and --feature-world three times
  reference points  one point on the housing and 2 points and more measured in the world and seen in the image
  points alone      4 points and more, none on the housing
points.csv: columns x_mm y_mm z_mm u_px v_px, optional suu svv suv (covariance of the pixel, px^2).
--feature X,Y,Z is a point of the housing in the camera's frame, --feature-world the same point measured in the
world; each may be given several times, in the same order. An X_WC in the camera's file is not read.
With a feature the distances of the points from their lines of sight are minimised, as published; --residual
reprojection takes the distances in the picture, which is the better estimate where points lie at different depths.
A point that contradicts the others is left out and named where the redundancy suffices.
Examples:
  zeropose calibrate pose --camera camera.json --points p.csv --feature=-30.6,21.8,-7.3 --feature-world=4628,1651,-3800
  zeropose calibrate pose --camera camera.json --points p.csv --json
Exit status: 0 done, 1 the points cannot give an answer (status and reason say why), 2 wrong usage or
unreadable input.)";

struct PoseOnlyOptions {
  std::string camera, name, points, output, report, active;
  std::vector<std::string> features, features_world;
  std::optional<std::string> residual;
  double sigma_px = 0, feature_sigma_mm = HousingFeature{}.sigma_mm;
  bool replace = false, json = false;
};

std::vector<HousingFeature> features_of(const PoseOnlyOptions& options) {
  if (options.features.size() != options.features_world.size())
    throw std::invalid_argument("--feature is given " + std::to_string(options.features.size()) +
                                " times, --feature-world " + std::to_string(options.features_world.size()) +
                                " times, expected as often");
  std::vector<HousingFeature> features;
  for (std::size_t i = 0; i < options.features.size(); ++i)
    features.push_back({place_of_option(options.features[i], "--feature"),
                        place_of_option(options.features_world[i], "--feature-world"),
                        options.feature_sigma_mm});
  if (options.points.empty() && features.size() < 3)
    throw std::invalid_argument("--points is required with fewer than three features");
  return features;
}

Json deviations_json(std::span<const CalibrationPoint> points, const PoseOnlyResult& result) {
  Json deviations = Json::array();
  for (std::size_t i = 0; i < result.deviations.size(); ++i)
    deviations.push_back({{"u_px", points[i].u_px.x()},
                          {"v_px", points[i].u_px.y()},
                          {"dev_px", json_of(result.deviations[i].dev_px)},
                          {"dev_mm", json_of(result.deviations[i].dev_mm)},
                          {"used", result.deviations[i].used}});
  return deviations;
}

Json answer_json(std::span<const CalibrationPoint> points, const PoseOnlyResult& result) {
  const bool good = result.status == PoseOnlyStatus::ok;
  Vector6 sigma = result.covariance.diagonal().cwiseSqrt();
  sigma.tail<3>() *= degrees_per_radian;
  Json json = {{"status", good ? "ok" : "failed"}, {"reason", result.reason}};
  json["what"] = name_of(result.status);
  json["X_WC"] = good ? Json(six_of(result.X_WC)) : Json();
  json["sigma"] = good ? json_of(sigma) : Json();
  json["covariance"] = Json();
  if (good) {
    json["covariance"] = Json::array();
    for (int row = 0; row < 6; ++row)
      json["covariance"].push_back(json_of(Vector6(result.covariance.row(row))));
  }
  json["sigma_px"] = result.sigma_px;
  json["rms_px"] = result.rms_px;
  json["redundancy"] = result.redundancy;
  json["deviations"] = deviations_json(points, result);
  json["feature_deviations_mm"] = Json::array();
  for (const Eigen::Vector3d& deviation : result.feature_deviations_mm)
    json["feature_deviations_mm"].push_back(json_of(deviation));
  Json alternatives = Json::array();
  for (const Pose& X_WC : result.alternatives) alternatives.push_back(six_of(X_WC));
  json["alternatives"] = std::move(alternatives);
  return json;
}

std::string answer_text(const PoseOnlyResult& result) {
  if (result.status != PoseOnlyStatus::ok) return "no answer: " + result.reason + "\n";
  Vector6 sigma = result.covariance.diagonal().cwiseSqrt();
  sigma.tail<3>() *= degrees_per_radian;
  std::ostringstream text;
  text << "X_WC, mm and degrees:\n"
       << table_of(six_of(result.X_WC)) << "\nsigma along and about the world's axes:\n"
       << table_of({sigma.data(), 6}) << "\ndeviations, px and mm (" << result.rms_px << " px rms):\n";
  for (std::size_t i = 0; i < result.deviations.size(); ++i)
    text << table_of({result.deviations[i].dev_px.data(), 2})
         << table_of({result.deviations[i].dev_mm.data(), 2}) << "  point " << i + 1
         << (result.deviations[i].used ? "" : "  left out: it contradicts the others") << "\n";
  for (const Eigen::Vector3d& deviation : result.feature_deviations_mm)
    text << table_of({deviation.data(), 3}) << "  feature, mm\n";
  return text.str();
}

std::optional<Pose> active_of(const PoseOnlyOptions& options) {
  if (options.active.empty()) return std::nullopt;
  const CameraFile active = load_camera(options.active, options.name);
  if (!active.has_pose || active.camera.on_hand)
    throw std::invalid_argument(options.active +
                                ": found no X_WC, expected it: the pose of the camera in use");
  return active.camera.X_WC;
}

std::string source_of(const PoseOnlyOptions& options) {
  return (options.points.empty() ? "" : "Points: " + options.points + ". ") + "Camera: " + options.camera +
         (options.name.empty() ? "" : " " + options.name);
}

Answer calibrate_pose_of(const PoseOnlyOptions& options) {
  const std::vector<HousingFeature> features = features_of(options);
  const CameraFile camera = load_camera(options.camera, options.name);
  std::vector<CalibrationPoint> points;
  if (!options.points.empty()) points = load_calibration_points(options.points);
  PoseOnlyProblem problem;
  problem.model = camera.camera.model;
  problem.points = points;
  problem.features = features;
  problem.sigma_px = options.sigma_px;
  const std::string residual = options.residual.value_or(features.empty() ? "reprojection" : "algebraic");
  problem.residual = residual == "algebraic" ? Residual::algebraic : Residual::reprojection;
  if (!options.output.empty()) refuse_existing(options.output, options.replace);
  const std::optional<Pose> active = active_of(options);
  const PoseOnlyResult result = calibrate_pose(problem);
  const bool good = result.status == PoseOnlyStatus::ok;
  if (good && !options.output.empty()) write_moved_camera(options.output, camera, result.X_WC);
  Answer answer{good ? done : no_answer, answer_json(points, result), answer_text(result)};
  if (good && !options.report.empty())
    write_page(options.report, pose_report(problem, result, active, source_of(options)), answer);
  return answer;
}

}  // namespace

void add_calibrate_pose(cli::Verb calibrate, int& exit_status) {
  auto options = std::make_shared<PoseOnlyOptions>();
  const Verb verb =
      calibrate.add_subcommand("pose", "X_WC of a camera whose internals are known, from measured points");
  verb.add_option("--camera", options->camera, "JSON of the camera: its internals").required();
  verb.add_option("--name", options->name, "of the camera, where the file holds several");
  verb.add_option("--output", options->output, "camera JSON to write, for zeropose calibration activate");
  verb.add_flag("--replace", options->replace, "overwrite --output");
  const VerbOption report =
      verb.add_option("--report", options->report, "the report as a page (SVG) to write");
  verb.add_option("--active", options->active, "camera JSON in use, for the report to compare with")
      .needs(report);
  verb.add_option("--points", options->points, "CSV: x_mm y_mm z_mm u_px v_px [suu svv suv]");
  verb.add_option("--feature", options->features, "FX,FY,FZ of a point on the housing, in the camera's frame")
      .once_per_value();
  verb.add_option("--feature-world", options->features_world,
                  "X,Y,Z of the same point, measured in the world")
      .once_per_value();
  verb.add_option("--feature-sigma-mm", options->feature_sigma_mm, "of one coordinate of a feature (0.02)")
      .range(1e-6, 100.0);
  verb.add_option("--sigma-px", options->sigma_px,
                  "noise of one pixel coordinate; without it from the residuals")
      .range(1e-6, 100.0);
  verb.add_option("--residual", options->residual,
                  "what is minimised: reprojection (px; without features) or algebraic (mm; with them)")
      .one_of({"reprojection", "algebraic"});
  verb.add_flag(
      "--json", options->json,
      "one JSON object on stdout: status, reason, X_WC, sigma, covariance (6x6, mm and rad), deviations,\n"
      "feature_deviations_mm, alternatives");
  verb.footer(calibrate_pose_help);
  verb.callback([options, &exit_status] {
    exit_status = run([&] { return calibrate_pose_of(*options); }, options->json);
  });
}

}  // namespace zeropose
