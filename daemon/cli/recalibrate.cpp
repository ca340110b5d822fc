#include "daemon/cli/recalibrate.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <optional>
#include <sstream>

#include "calib/words.h"
#include "config/camera_file.h"
#include "config/cell.h"
#include "config/recalibration_tables.h"
#include "daemon/cli/answer.h"
#include "daemon/cli/camera_report.h"
#include "daemon/cli/measured_references.h"
#include "daemon/cli/output.h"
#include "measure/proposal.h"

namespace zeropose {
namespace {

using namespace cli;

constexpr const char* recalibrate_help =
    R"(A camera was knocked: where is it now? From fixed points that it saw before and sees after.
  known      3 points and more whose coordinates in the world are known (--points): the whole pose. 5 and more
             tell which point was itself moved.
  arbitrary  2 points and more, coordinates unknown: the rotation alone. What is in truth a shift t turns up as a
             wrong rotation of about t / distance: 1 mm at 2500 mm is 0.023 degrees.
  groups     2 groups (plates) and more of 3 points and more, coordinates inside each plate known (--points): the
             whole change.
before.csv, after.csv: columns point u_px v_px, for groups also group; optional suu svv suv (covariance, px^2).
points.csv: point x_mm y_mm z_mm, optional group where names repeat from plate to plate.
The answer X_WC is the new pose of the camera, X_CoCn that of the new camera in the old one's frame, sigma and
covariance belong to X_WC, along and about the world's axes (mm, degrees; the covariance mm and rad).
--sigma-px is the noise of one pixel coordinate; without it the sigmas come from the residuals.
With --cell and --measured instead of --camera, --before, --after, --points: camera --name of the cell, its reference
points, their pixels at the zero measurement and now. measured.json is what `zeropose measure --json` answered; noise is
the cell's reference_check sigma_px, of more than three known points that of the residuals, unless --sigma-px says otherwise. The daemon proposes a place by itself,
each pixel weighted by its own noise: zeropose status says where a moved camera is and what that changes.
docs/recalibration.md says which points to choose.
Examples:
  zeropose measure --json > measured.json
  zeropose recalibrate --cell cell.json --name camera2 --measured measured.json --output camera2.json
  zeropose recalibrate --method known --camera camera.json --before b.csv --after a.csv --points p.csv --json
Nothing is activated: give --output to zeropose calibration activate and take a new zero measurement.
Exit status: 0 done, 1 the points cannot give an answer (status and reason say why), 2 wrong usage or
unreadable input.)";

struct RecalibrateOptions {
  std::string method, camera, name, before, after, points, cell, measured, output, report;
  double sigma_px = 0;
  bool replace = false, json = false;
};

RecalibrationMethod method_of(const std::string& name) {
  if (name == "known") return RecalibrationMethod::known_points;
  return name == "groups" ? RecalibrationMethod::groups : RecalibrationMethod::arbitrary_points;
}

// A camera as calibrated, what it saw before and sees now, and the noise where it is known.
struct Knock {
  RecalibrationMethod method = RecalibrationMethod::known_points;
  CameraFile camera;
  std::vector<RecalibrationPoint> points;
  double sigma_px = 0;
};

void require_fitting_options(const RecalibrateOptions& options, const CameraFile& camera) {
  if (options.method.empty()) throw std::invalid_argument("--method is required with --camera");
  const bool arbitrary = options.method == "arbitrary";
  for (const auto& [value, option] :
       {std::pair(&options.before, "--before"), std::pair(&options.after, "--after")})
    if (value->empty()) throw std::invalid_argument(concat({option, " is required with --camera"}));
  if (!arbitrary && options.points.empty())
    throw std::invalid_argument("--points is required with --method " + options.method);
  if (arbitrary && !options.points.empty())
    throw std::invalid_argument("--points is not used with --method arbitrary, which takes no coordinates");
  if (!camera.has_pose)
    throw std::invalid_argument(options.camera +
                                ": the camera has no X_WC, expected its pose before it moved");
}

std::string name_of(const RecalibrationPoint& point) {
  return point.group.empty() ? point.name : point.group + "/" + point.name;
}

Json deviations_json(const RecalibrationProblem& problem, const RecalibrationResult& result) {
  Json deviations = Json::array();
  for (std::size_t i = 0; i < result.deviations.size(); ++i) {
    const RecalibrationDeviation& deviation = result.deviations[i];
    Json json = {{"point", problem.points[i].name}};
    if (!problem.points[i].group.empty()) json["group"] = problem.points[i].group;
    json["dev_px"] = json_of(deviation.new_px);
    if (problem.method != RecalibrationMethod::arbitrary_points)
      json["dev_before_px"] = json_of(deviation.old_px);
    json["used"] = deviation.used;
    json["removed"] = std::ranges::find(result.removed, i) != result.removed.end();
    deviations.push_back(std::move(json));
  }
  return deviations;
}

Json names_json(const RecalibrationProblem& problem, const std::vector<std::size_t>& chosen) {
  Json names = Json::array();
  for (const std::size_t i : chosen) names.push_back(name_of(problem.points[i]));
  return names;
}

// A translation that is neglected has no sigma.
Json sigma_json(const RecalibrationResult& result) {
  Json sigma = Json::array();
  for (int i = 0; i < 6; ++i) {
    const double value = std::sqrt(result.covariance(i, i)) * (i < 3 ? 1 : degrees_per_radian);
    sigma.push_back(i < 3 && !result.translation_known ? Json() : Json(value));
  }
  return sigma;
}

Json covariance_of(const RecalibrationResult& result) {
  Json rows = Json::array();
  for (int row = 0; row < 6; ++row) {
    Json numbers = Json::array();
    for (int column = 0; column < 6; ++column)
      numbers.push_back(!result.translation_known && std::min(row, column) < 3
                            ? Json()
                            : Json(result.covariance(row, column)));
    rows.push_back(std::move(numbers));
  }
  return rows;
}

Json answer_json(const RecalibrationProblem& problem, const RecalibrationResult& result) {
  const bool good = result.code == Code::ok;
  Json json = {{"status", good ? "ok" : "failed"},
               {"reason", result.reason},
               {"code", static_cast<int>(result.code)},
               {"name", text_of(result.code).name}};
  // No number that could be taken for a pose unless it is one.
  json["method"] = name_of(problem.method);
  json["X_WC"] = good ? Json(six_of(result.X_WCn)) : Json();
  json["X_CoCn"] = good ? Json(six_of(result.X_CoCn)) : Json();
  json["translation_known"] = result.translation_known;
  json["sigma"] = good ? sigma_json(result) : Json();
  json["covariance"] = good ? covariance_of(result) : Json();
  json["sigma_px"] = result.sigma_px;
  json["rms_px"] = result.rms_px;
  json["redundancy"] = result.redundancy;
  json["deviations"] = deviations_json(problem, result);
  json["removed"] = names_json(problem, result.removed);
  json["suspects"] = names_json(problem, result.suspects);
  json["warnings"] = result.warnings;
  return json;
}

std::string answer_text(const RecalibrationProblem& problem, const RecalibrationResult& result) {
  if (result.code != Code::ok) return "no answer: " + result.reason + "\n";
  Vector6 sigma = result.covariance.diagonal().cwiseSqrt();
  sigma.tail<3>() *= degrees_per_radian;
  std::ostringstream text;
  text << "change X_CoCn, mm and degrees:\n"
       << table_of(six_of(result.X_CoCn)) << "\nnew pose X_WC:\n"
       << table_of(six_of(result.X_WCn)) << "\n";
  if (result.translation_known)
    text << "sigma along and about the world's axes:\n" << table_of({sigma.data(), 6}) << "\n";
  else
    text << "sigma about the world's axes (the translation is neglected):\n"
         << table_of({sigma.data() + 3, 3}) << "\n";
  text << "deviations after, px (" << result.rms_px << " rms):\n";
  for (std::size_t i = 0; i < result.deviations.size(); ++i)
    text << table_of({result.deviations[i].new_px.data(), 2}) << "  " << name_of(problem.points[i])
         << (result.deviations[i].used ? "" : "  left out: it moved itself") << "\n";
  for (const std::string& warning : result.warnings) text << "warning: " << warning << "\n";
  return text.str();
}

Knock knock_of_tables(const RecalibrateOptions& options) {
  const CameraFile camera = load_camera(options.camera, options.name);
  require_fitting_options(options, camera);
  const RecalibrationMethod method = method_of(options.method);
  return {method, camera, load_recalibration_points(method, {options.before, options.after, options.points})};
}

Knock knock_of_cell(const RecalibrateOptions& options) {
  const Cell cell = load_cell(options.cell);
  const auto camera = std::ranges::find(cell.calibration, options.name, &CalibratedCamera::name);
  if (camera == cell.calibration.end())
    throw std::invalid_argument(
        concat({options.cell, ": has no camera \"", options.name, "\"; name one by --name"}));
  const auto index = static_cast<std::size_t>(camera - cell.calibration.begin());
  const RecalibrationMethod method =
      options.method.empty() ? suited_method(cell.references, index) : method_of(options.method);
  auto points = measured_references(cell, method, options.method.empty(), options.name, options.measured);
  // Coordinates err by more than the pixels; of more points than it takes the residuals tell.
  const bool from_residuals = method == RecalibrationMethod::known_points && points.size() > 3;
  return {method, {*camera, true}, std::move(points), from_residuals ? 0 : cell.references.sigma_px};
}

// A calibrated pose that misses the pixels before by so much is another camera's, or the points are other
// ones.
void refuse_strangers(RecalibrationResult& result) {
  constexpr double strange_px = 50;
  double sum = 0, count = 0;
  for (const RecalibrationDeviation& deviation : result.deviations)
    if (deviation.used) sum += deviation.old_px.squaredNorm(), ++count;
  if (result.code != Code::ok || sum <= strange_px * strange_px * count) return;
  result.code = Code::deviation_not_attributable;
  result.reason =
      concat({"the calibrated pose misses the pixels before by ", number(std::sqrt(sum / count)),
              " px (root mean square): is this the camera, and are these its points, in mm of the world?"});
}

std::string source_of(const RecalibrateOptions& options) {
  if (!options.cell.empty()) return concat({"Cell: ", options.cell, ". Measured: ", options.measured});
  return concat({"Camera: ", options.camera, ". Before: ", options.before, ". After: ", options.after,
                 options.points.empty() ? "" : ". Points: ", options.points});
}

Answer recalibrate_camera(const RecalibrateOptions& options) {
  if (options.cell.empty() == options.camera.empty())
    throw std::invalid_argument(
        "which camera? Give --camera with --before and --after, or --cell with --name and --measured");
  const Knock knock = options.cell.empty() ? knock_of_tables(options) : knock_of_cell(options);
  if (knock.camera.camera.on_hand)
    throw std::invalid_argument(
        concat({options.camera, options.cell,
                ": the camera has X_HC, expected X_WC: one on a hand has no place of its own"}));
  RecalibrationProblem problem;
  problem.method = knock.method;
  problem.model = knock.camera.camera.model;
  problem.X_WCo = knock.camera.camera.X_WC;
  problem.sigma_px = options.sigma_px > 0 ? options.sigma_px : knock.sigma_px;
  problem.points = knock.points;
  if (!options.output.empty()) refuse_existing(options.output, options.replace);
  RecalibrationResult result = recalibrate(problem);
  refuse_strangers(result);
  if (result.code == Code::ok && !options.output.empty())
    write_moved_camera(options.output, knock.camera, result.X_WCn);
  Answer answer{result.code == Code::ok ? done : no_answer, answer_json(problem, result),
                answer_text(problem, result)};
  if (result.code == Code::ok && !options.report.empty())
    write_page(options.report, recalibration_report(problem, result, options.name, source_of(options)),
               answer);
  return answer;
}

}  // namespace

void add_recalibrate(cli::Verb app, int& exit_status) {
  auto options = std::make_shared<RecalibrateOptions>();
  const Verb verb =
      app.add_subcommand("recalibrate", "Where a camera that was knocked is now, from fixed points");
  verb.add_option(
          "--method", options->method,
          "known, arbitrary or groups; with --measured it may be left out: what suits the camera's points")
      .one_of({"known", "arbitrary", "groups"});
  const VerbOption camera =
      verb.add_option("--camera", options->camera, "JSON of the camera as calibrated, with its X_WC");
  verb.add_option("--name", options->name, "of the camera, where the file holds several");
  verb.add_option("--output", options->output, "camera JSON to write, for zeropose calibration activate");
  verb.add_flag("--replace", options->replace, "overwrite --output");
  verb.add_option("--report", options->report, "the report as a page (SVG) to write");
  const VerbOption before =
      verb.add_option("--before", options->before, "CSV: point [group] u_px v_px before it was moved");
  const VerbOption after = verb.add_option("--after", options->after, "CSV: the same points after");
  const VerbOption points = verb.add_option("--points", options->points,
                                            "CSV: point x_mm y_mm z_mm in the world, or inside the group");
  const VerbOption cell = verb.add_option("--cell", options->cell, "the cell file with the reference points");
  const VerbOption measured =
      verb.add_option("--measured", options->measured, "JSON: what zeropose measure --json answered");
  measured.needs(cell), cell.needs(measured);
  for (const VerbOption& table : {camera, before, after, points}) cell.excludes(table);
  verb.add_option("--sigma-px", options->sigma_px, "noise of one pixel coordinate").range(1e-6, 100.0);
  verb.add_flag(
      "--json", options->json,
      "one JSON object on stdout: status, reason, code, X_WC, X_CoCn, sigma, covariance (6x6, mm and\n"
      "rad), deviations, removed, suspects, warnings");
  verb.footer(recalibrate_help);
  verb.callback([options, &exit_status] {
    exit_status = run([&] { return recalibrate_camera(*options); }, options->json);
  });
}

}  // namespace zeropose
