#include <memory>
#include <optional>
#include <sstream>

#include "config/cameras.h"
#include "config/sensor_tables.h"
#include "config/text.h"
#include "daemon/cli/answer.h"
#include "daemon/cli/calibrate.h"
#include "daemon/cli/convert.h"
#include "daemon/cli/output.h"
#include "daemon/cli/place_report.h"

namespace zeropose {
namespace {

using namespace cli;

constexpr const char* calibrate_sensor_help =
    R"(A stereo sensor: cameras whose poses X_SC in the sensor's frame S are known (calibrate views gives them for a rig).
Stationary: points.csv has three points or more, not on a line, known in the world; the sensor sees them once: X_WS.
On a robot's hand, with --robot robot.csv (view x_mm y_mm z_mm rx_deg ry_deg rz_deg = X_RH): the points are known in
the robot's base R, one is enough, and the sensor sees it from three positions of the hand and more: X_HS. In the
hand's frame the point must not move along one line.
observations.csv: camera point u_px v_px [suu svv suv] and with --robot view. Every place is weighted with the
covariance of its triangulation; --sigma-mm is that of a known point's coordinate, on the hand with the robot's own
uncertainty (column sigma_mm: of single points).
Examples:
  zeropose calibrate sensor --cameras sensor.json --points points.csv --observations observations.csv
  zeropose calibrate sensor --cameras sensor.json --points tip.csv --observations seen.csv --robot robot.csv --json
Exit status: 0 done, 1 the points cannot give an answer (status and reason say why), 2 wrong usage or
unreadable input.)";

struct Options {
  std::string cameras, points, observations, robot, report, output;
  std::optional<std::string> active;
  double sigma_mm = KnownPoint{}.sigma_mm;
  bool replace = false, json = false;
};

struct Input {
  std::vector<CalibratedCamera> cameras;
  std::vector<KnownPoint> points;
  std::vector<SensorSighting> sightings;
};

Json covariance_json(const Matrix6& covariance) {
  Json rows = Json::array();
  for (int row = 0; row < 6; ++row) rows.push_back(json_of(Vector6(covariance.row(row))));
  return rows;
}

Json sighting_json(const Input& input, const SensorResult& result, std::size_t i) {
  const auto is_in = [i](const std::vector<std::size_t>& list) {
    return std::find(list.begin(), list.end(), i) != list.end();
  };
  Json json{{"point", input.points[input.sightings[i].point].name}};
  if (!input.sightings[i].view.empty()) json["view"] = input.sightings[i].view;
  json["p_S"] = json_of(result.places[i].p_W_mm);
  json["residual_mm"] = json_of(result.fit.residuals_mm[i]);
  json["ray_gap_mm"] = result.places[i].ray_gap_mm;
  json["removed"] = is_in(result.fit.removed);
  json["suspect"] = is_in(result.fit.suspects);
  return json;
}

Json sensor_json(const Input& input, const SensorResult& result, const char* pose) {
  const bool good = result.fit.status == FrameFitStatus::ok;
  Json json = {{"status", good ? "ok" : "failed"},
               {"reason", result.fit.reason},
               {"what", name_of(result.fit.status)}};
  json[pose] = good ? Json(six_of(result.fit.X_AB)) : Json();
  Vector6 sigma = result.fit.covariance.diagonal().cwiseSqrt();
  sigma.tail<3>() *= degrees_per_radian;
  json["sigma"] = good ? json_of(sigma) : Json();
  json["covariance"] = good ? covariance_json(result.fit.covariance) : Json();
  json["rms_mm"] = result.fit.rms_mm;
  json["redundancy"] = result.fit.redundancy;
  json["points"] = Json::array();
  for (std::size_t i = 0; i < result.fit.residuals_mm.size(); ++i)
    json["points"].push_back(sighting_json(input, result, i));
  return json;
}

std::string sensor_text(const Input& input, const SensorResult& result, const char* pose) {
  if (result.fit.status != FrameFitStatus::ok) return concat({"no answer: ", result.fit.reason, "\n"});
  Vector6 sigma = result.fit.covariance.diagonal().cwiseSqrt();
  sigma.tail<3>() *= degrees_per_radian;
  std::ostringstream text;
  text << pose << ", mm and degrees:\n"
       << table_of(six_of(result.fit.X_AB)) << "\nsigma:\n"
       << table_of({sigma.data(), 6}) << "\nresiduals, mm (" << result.fit.rms_mm << " rms):\n";
  for (std::size_t i = 0; i < input.sightings.size(); ++i) {
    const SensorSighting& sighting = input.sightings[i];
    const bool removed =
        std::find(result.fit.removed.begin(), result.fit.removed.end(), i) != result.fit.removed.end();
    text << table_of({result.fit.residuals_mm[i].data(), 3}) << "  " << input.points[sighting.point].name
         << " " << sighting.view << (removed ? "  left out: it contradicts the others" : "") << "\n";
  }
  return text.str();
}

// The cameras where the sensor is, ready for `zeropose calibration activate`.
std::vector<CalibratedCamera> placed(std::vector<CalibratedCamera> cameras, const Pose& X_AS, bool on_hand) {
  for (CalibratedCamera& camera : cameras) {
    camera.X_WC = X_AS * camera.X_WC;
    camera.on_hand = on_hand;
  }
  return cameras;
}

Answer calibrate(const Options& options) {
  Input input;
  input.cameras = load_cameras(options.cameras);
  input.points = load_known_points(options.points, options.sigma_mm);
  if (!options.output.empty()) refuse_existing(options.output, options.replace);
  std::optional<NamedPoses> hand;
  if (!options.robot.empty()) hand = load_named_poses(options.robot);
  input.sightings = load_sightings(options.observations, input.cameras, input.points, hand);
  const SensorProblem problem{input.cameras, input.points, input.sightings};
  const std::optional<Pose> active = pose_of_option(options.active, "--active");
  const SensorResult result = calibrate_sensor(problem);
  const char* pose = hand ? "X_HS" : "X_WS";
  const bool good = result.fit.status == FrameFitStatus::ok;
  if (good && !options.output.empty())
    replace_file(options.output, cameras_text(placed(input.cameras, result.fit.X_AB, hand.has_value())));
  Answer answer{good ? done : no_answer, sensor_json(input, result, pose), sensor_text(input, result, pose)};
  if (good && !options.report.empty())
    write_page(options.report,
               sensor_report(problem, result, pose, active,
                             concat({"Cameras: ", options.cameras, ". Points: ", options.points,
                                     ". Observations: ", options.observations})),
               answer);
  return answer;
}

}  // namespace

void add_calibrate_sensor(cli::Verb calibrate_verb, int& exit_status) {
  auto options = std::make_shared<Options>();
  const Verb verb =
      calibrate_verb.add_subcommand("sensor", "Where a stereo sensor stands, or sits on a hand");
  verb.add_option("--cameras", options->cameras, "JSON {\"name\": camera, ...} with poses X_SC as X_WC")
      .required();
  verb.add_option("--points", options->points, "CSV: point x_mm y_mm z_mm [sigma_mm]").required();
  verb.add_option("--observations", options->observations,
                  "CSV: camera point u_px v_px [suu svv suv], with --robot also view")
      .required();
  verb.add_option("--robot", options->robot, "CSV: view x_mm y_mm z_mm rx_deg ry_deg rz_deg, X_RH");
  verb.add_option("--sigma-mm", options->sigma_mm, "of one coordinate of a known point (0.02)")
      .range(1e-6, 100.0);
  verb.add_option("--output", options->output, "JSON of the cameras with X_WC or X_HC to write");
  verb.add_flag("--replace", options->replace, "overwrite --output; the old file is kept as .previous");
  const VerbOption report =
      verb.add_option("--report", options->report, "the report as a page (SVG) to write");
  verb.add_option("--active", options->active, "x,y,z,rx,ry,rz in use, for the report to compare with")
      .needs(report);
  verb.add_flag("--json", options->json,
                "one JSON object on stdout: status, reason, X_WS or X_HS, sigma, covariance, rms_mm, points\n"
                "[{point, view, p_S, residual_mm, ray_gap_mm, removed, suspect}]");
  verb.footer(calibrate_sensor_help);
  verb.callback(
      [options, &exit_status] { exit_status = run([&] { return calibrate(*options); }, options->json); });
}

}  // namespace zeropose
