#include "daemon/cli/calibrate_views.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <iostream>
#include <memory>
#include <optional>

#include "calib/views.h"
#include "config/atomic_file.h"
#include "config/calibration_tables.h"
#include "config/camera_file.h"
#include "config/cameras.h"
#include "config/csv.h"
#include "config/files.h"
#include "config/pose_table.h"
#include "config/text.h"
#include "daemon/cli/answer.h"
#include "daemon/cli/calibration_answer.h"
#include "daemon/cli/output.h"
#include "daemon/cli/views_report.h"

namespace zeropose {
namespace {

using namespace cli;

constexpr const char* help =
    R"(Each view is one position of the board or body before the camera; its pose need not be known. At least three
views of a flat board, tilted against the camera by 20 to 40 degrees about different axes, that fill the image.
Coordinates are the board's. With the column camera the cameras are one rig: all stand still while the board
moves, and the answer has their relative poses too; the world is then the first camera's frame. suu svv suv is
the covariance of the pixel in px^2 (none: one pixel), radius_mm that of a round flat mark, whose eccentricity
is then corrected (nx ny nz: its normal, else 0 0 1).
--start takes size, model and start values of the cameras that it names from a file of cameras
({"name": camera, ...}, or one camera alone); --fix holds parameters there, and without a start the origin in the
image centre and lens coefficients at 0. Parameters: fx fy cx cy, K (division), k1 k2 p1 p2 k3 (brown).
--poses: known X_WB of views (a linear stage, a robot); their frame is that of all poses, and the first one may be
0 0 0 0 0 0, so that the board's first position is the frame of a stereo sensor. A board never sits exactly parallel
to the stage that moves it. --stage check takes it so and says what the points say about that; --stage estimate finds
the turn between the stage's axes and the board's (X_BS) together with the cameras: then only the first known view
stands exactly where the table says, and the others along the stage's own axes. One direction of motion shows two
turns, two directions three, motions with turns shifts as well. Two cameras that look from two sides tell the turn
best; one camera with fx and fy free hardly does, which is said (--one-focal, --fix fx,fy with --start).
Example: points.csv
  view, x_mm, y_mm, u_px, v_px
  1, 0, 0, 211.32, 145.90
  1, 30, 0, 248.05, 144.77
  ...
  zeropose calibrate views --points points.csv --width 1280 --height 1024 --model brown --fix k3 --json
Exit status: 0 done, 1 the points do not determine the camera (status and reason say why), 2 wrong usage or
unreadable input.)";

struct ViewsOptions {
  std::string points;
  int width_px = 0, height_px = 0;
  std::string model = "division", stage = "check";
  std::optional<std::string> start, fix, report, poses;
  std::string output;
  bool one_focal = false, replace = false;
  double sigma_px = 0, reject_px = 0, robust = 0;
  bool json = false;
};

// A file of cameras by name, or one camera: that of the table's only camera.
std::vector<CalibratedCamera> starts_of(const std::string& file, const std::vector<std::string>& cameras) {
  const std::string text = read_file(file);
  const Json tree = Json::parse(text, nullptr, false, true);
  const bool alone = tree.is_object() && tree.contains("model");
  if (alone && cameras.size() != 1)
    throw std::invalid_argument(
        concat({file, ": found one camera, expected {\"name\": camera, ...}: the table has several"}));
  const std::vector<CalibratedCamera> starts =
      parse_cameras(alone ? concat({"{", Json(cameras.front()).dump(), ":", text, "\n}"}) : text, file);
  for (const CalibratedCamera& start : starts)
    if (std::ranges::find(cameras, start.name) == cameras.end())
      throw std::invalid_argument(concat({file, ": found the camera ", in_quotes(start.name),
                                          ", expected a name that the table of points has"}));
  return starts;
}

ParameterSet fixed_of(const std::optional<std::string>& text) {
  ParameterSet fixed;
  std::istringstream names(text.value_or(""));
  for (std::string name; std::getline(names, name, ',');) {
    std::erase(name, ' ');
    const auto parameter = parameter_named(name);
    if (!parameter || pose_parameters.has(*parameter))
      throw std::invalid_argument(
          concat({"--fix: found ", in_quotes(name), ", expected fx fy cx cy K k1 k2 p1 p2 or k3"}));
    fixed.add(*parameter);
  }
  return fixed;
}

std::vector<ViewsCamera> cameras_of(const ViewsOptions& options, const std::vector<std::string>& names) {
  std::vector<CalibratedCamera> starts;
  if (options.start) starts = starts_of(*options.start, names);
  std::vector<ViewsCamera> cameras;
  for (const std::string& name : names) {
    ViewsCamera camera{name, options.width_px,      options.height_px, {},
                       {},   fixed_of(options.fix), options.one_focal};
    camera.lens = options.model == "brown" ? LensModel::brown : LensModel::division;
    const auto start = std::ranges::find(starts, name, &CalibratedCamera::name);
    if (start != starts.end()) {
      camera.start = start->model;
      camera.width_px = start->model.width_px, camera.height_px = start->model.height_px;
      camera.lens = std::holds_alternative<BrownConrady>(start->model.distortion) ? LensModel::brown
                                                                                  : LensModel::division;
    } else if (options.width_px == 0 || options.height_px == 0) {
      throw std::invalid_argument(concat({"--width and --height: the size of camera ", in_quotes(name),
                                          " is not given, neither here nor by --start"}));
    }
    cameras.push_back(camera);
  }
  return cameras;
}

ReportedUncertainty internals_of(const ViewsResult& result, std::size_t camera) {
  return reported_uncertainty(result.cameras[camera].internals, result.cameras[camera].X_WC);
}

// Six numbers' sigmas: mm along and degrees about the axes of the frame that the pose is given in.
Json pose_sigma_json(const Matrix6& covariance) {
  Vector6 sigma = covariance.diagonal().cwiseSqrt();
  sigma.tail<3>() *= degrees_per_radian;
  return json_of(sigma);
}

std::vector<CalibratedCamera> calibrated(const CalibrationViews& input, const ViewsResult& result) {
  std::vector<CalibratedCamera> cameras;
  for (std::size_t c = 0; c < result.cameras.size(); ++c)
    cameras.push_back({input.cameras[c], result.cameras[c].model, result.cameras[c].X_WC});
  return cameras;
}

Json cameras_json(const CalibrationViews& input, const ViewsResult& result) {
  return Json::parse(cameras_text(calibrated(input, result)));
}

// A camera alone has a pose only where those of the board are known.
void write_cameras(const std::string& file, const CalibrationViews& input, const ViewsResult& result,
                   bool known_poses) {
  std::vector<CalibratedCamera> cameras = calibrated(input, result);
  if (cameras.size() == 1) cameras.front().name.clear();
  replace_file(file,
               cameras.size() > 1 ? cameras_text(cameras) : camera_file_text({cameras.front(), known_poses}));
}

// One camera: its values; a rig: by camera name.
void add_cameras(Json& json, const CalibrationViews& input, const ViewsResult& result) {
  const Json cameras = cameras_json(input, result);
  const bool rig = input.cameras.size() > 1;
  json[rig ? "cameras" : "camera"] = rig ? cameras : cameras.at(input.cameras.front());
  Json sigma, correlation, rms, pose_sigma;
  for (std::size_t c = 0; c < input.cameras.size(); ++c) {
    const std::string& name = input.cameras[c];
    sigma[name] = sigma_json(internals_of(result, c));
    correlation[name] = correlation_json(internals_of(result, c));
    pose_sigma[name] = pose_sigma_json(result.cameras[c].pose_covariance);
    rms[name] = result.cameras[c].rms_px;
  }
  json["sigma"] = rig ? sigma : sigma.front();
  json["correlation"] = rig ? correlation : correlation.front();
  if (!rig) return;
  json["sigma_X_WC"] = pose_sigma;
  json["camera_rms_px"] = rms;
}

// Of the views: with one camera that nothing else holds, the world is the camera.
const char* pose_name(const CalibrationViews& input, bool known_poses) {
  return input.cameras.size() > 1 || known_poses ? "X_WB" : "X_CB";
}

Json views_json(const CalibrationViews& input, const ViewsResult& result, const std::string& pose) {
  Json views = Json::array();
  for (std::size_t v = 0; v < result.views.size(); ++v)
    views.push_back({{"view", input.views[v]},
                     {pose, six_of(result.views[v].X_WB)},
                     {"sigma", pose_sigma_json(result.views[v].covariance)},
                     {"rms_px", result.views[v].rms_px},
                     {"points_used", result.views[v].points_used}});
  return views;
}

Json deviations_json(const CalibrationViews& input, const ViewsResult& result) {
  Json deviations = Json::array();
  for (std::size_t i = 0; i < result.deviations.size(); ++i) {
    const ViewPoint& seen = input.points[i];
    const CalibrationDeviation& deviation = result.deviations[i];
    Json json{{"view", input.views[seen.view]}};
    if (input.cameras.size() > 1) json["camera"] = input.cameras[seen.camera];
    json.update(Json{{"u_px", seen.point.u_px.x()},
                     {"v_px", seen.point.u_px.y()},
                     {"dev_px", json_of(deviation.dev_px)},
                     {"dev_mm", json_of(deviation.dev_mm)},
                     {"used", deviation.used}});
    deviations.push_back(json);
  }
  return deviations;
}

Json stage_json(const StageEstimate& stage) {
  const bool known = stage.unknown.empty();
  Json json{
      {"axes", stage.held ? "held" : "estimated"}, {"reason", stage.unknown}, {"unknowns", stage.unknowns}};
  json["X_BS"] = known ? Json(six_of(stage.X_BS)) : Json();
  json["sigma"] = known ? pose_sigma_json(stage.covariance) : Json();
  json["chance"] = stage.chance;
  json["rms_px"] = stage.rms_px;
  if (stage.held) json["answer_moves_sigmas"] = stage.answer_moves_sigmas;
  return json;
}

Json json_of_result(const CalibrationViews& input, const ViewsResult& result, const char* pose) {
  Json json{{"status", name_of(result.status)}, {"reason", result.reason}};
  if (result.status != CalibrationStatus::ok) return json;
  add_cameras(json, input, result);
  json["views"] = views_json(input, result, pose);
  if (result.stage) json["stage"] = stage_json(*result.stage);
  json["rms_px"] = result.rms_px;
  json["sigma_px"] = result.sigma_px;
  json["residual_sum"] = result.residual_sum;
  json["deviations"] = deviations_json(input, result);
  json["rejected"] = result.rejected.size();
  json["iterations"] = result.iterations;
  json["diagnosis"] = {{"condition", result.diagnosis.condition},
                       {"coplanar", result.diagnosis.coplanar},
                       {"warnings", result.diagnosis.warnings}};
  return json;
}

std::string text_of_result(const CalibrationViews& input, const ViewsResult& result, const char* pose) {
  if (result.status != CalibrationStatus::ok)
    return concat({"no answer (", name_of(result.status), "): ", result.reason, "\n"});
  std::ostringstream text;
  const Json cameras = cameras_json(input, result);
  for (std::size_t c = 0; c < input.cameras.size(); ++c) {
    text << input.cameras[c] << ":\n  " << cameras.at(input.cameras[c]).dump() << "\n  sigma "
         << sigma_json(internals_of(result, c)).dump() << "\n";
  }
  text << pose << " of the views, mm and degrees, and rms, px:\n";
  for (std::size_t v = 0; v < result.views.size(); ++v)
    text << table_of(six_of(result.views[v].X_WB)) << table_of({&result.views[v].rms_px, 1}) << "  "
         << input.views[v] << "\n";
  if (result.stage) text << "the stage's axes: " << stage_text(*result.stage) << "\n";
  text << "rms " << result.rms_px << " px over all points used, " << result.rejected.size() << " of "
       << input.points.size() << " rejected\n";
  for (const std::string& warning : result.diagnosis.warnings) text << "warning: " << warning << "\n";
  return text.str();
}

// So many take long enough that somebody wants to see it go on.
constexpr std::size_t many_points = 20000;

// One camera: the file as named. A rig: with the camera's name before the extension, one page each.
void write_pages(const std::filesystem::path& file, const std::filesystem::path& points,
                 const CalibrationViews& input, const ViewsProblem& problem, const ViewsResult& result) {
  const std::string source = concat({"Points: ", points.filename().string()});
  for (std::size_t c = 0; c < input.cameras.size(); ++c) {
    std::filesystem::path own = file;
    if (input.cameras.size() > 1)
      own.replace_filename(concat({file.stem().string(), "-", input.cameras[c], file.extension().string()}));
    replace_file(own, page_of_camera(input, problem, result, c, source));
  }
}

// Views without a line in the table keep their unknown pose; a line without a view is a slip of the pen.
void add_known_poses(const std::string& file, std::vector<BoardView>& views) {
  for (const auto& [name, X_WB] : load_named_poses(file)) {
    const auto view = std::find_if(views.begin(), views.end(),
                                   [&, &wanted = name](const BoardView& one) { return one.name == wanted; });
    if (view == views.end())
      throw ConfigError({concat({file, ": found view ", in_quotes(name), ", which has no points"})});
    view->X_WB = X_WB;
  }
}

Answer calibrate_views_of(const ViewsOptions& options) {
  if (options.stage == "estimate" && !options.poses)
    throw std::invalid_argument("--stage estimate: how a stage moves the board must be known, give --poses");
  const CalibrationViews input = load_calibration_views(options.points);
  if (input.points.empty())
    return {
        no_answer, {{"status", "too_few_points"}, {"reason", "the table holds no points"}}, "no points\n"};
  const std::vector<ViewsCamera> cameras = cameras_of(options, input.cameras);
  std::vector<BoardView> views;
  for (const std::string& name : input.views) views.push_back({name, std::nullopt});
  if (options.poses) add_known_poses(*options.poses, views);
  ViewsProblem problem;
  problem.cameras = cameras, problem.views = views, problem.points = input.points;
  problem.sigma_px = options.sigma_px, problem.reject_px = options.reject_px, problem.robust = options.robust;
  problem.stage = options.stage == "estimate" ? StageAxes::estimate : StageAxes::check;
  if (input.points.size() > many_points)
    problem.progress = [&input](int iteration, double cost) {
      std::cerr << "step " << iteration << ": rms "
                << std::sqrt(2 * cost / static_cast<double>(input.points.size())) << " px\n";
    };
  if (!options.output.empty()) refuse_existing(options.output, options.replace);
  const ViewsResult result = calibrate_views(problem);
  if (!options.output.empty() && result.status == CalibrationStatus::ok)
    write_cameras(options.output, input, result, options.poses.has_value());
  if (options.report && result.status == CalibrationStatus::ok)
    write_pages(*options.report, options.points, input, problem, result);
  const char* pose = pose_name(input, options.poses.has_value());
  return {result.status == CalibrationStatus::ok ? done : no_answer, json_of_result(input, result, pose),
          text_of_result(input, result, pose)};
}

void add_options(cli::Verb verb, ViewsOptions& options) {
  verb.add_option("--points", options.points,
                  "CSV: view [camera] x_mm y_mm [z_mm] u_px v_px [suu svv suv] [radius_mm nx ny nz]")
      .required();
  verb.add_option("--width", options.width_px, "of the image, px").range(1, 65535);
  verb.add_option("--height", options.height_px, "of the image, px").range(1, 65535);
  verb.add_option("--model", options.model, "the lens: division or brown (division)")
      .one_of({"division", "brown"});
  verb.add_option("--start", options.start, "a file of cameras to begin with");
  verb.add_option(
      "--poses", options.poses,
      "CSV: view x_mm y_mm z_mm rx_deg ry_deg rz_deg, known X_WB (stage, robot): the frame of all poses");
  verb.add_option("--stage", options.stage,
                  "with --poses, the stage's axes: check that they are the board's, or estimate them (check)")
      .one_of({"check", "estimate"});
  verb.add_option("--fix", options.fix, "parameters to hold, parted by commas, e.g. p1,p2,k3");
  verb.add_flag("--one-focal", options.one_focal, "fx = fy");
  verb.add_option("--sigma-px", options.sigma_px, "of one pixel coordinate; without it from the residuals")
      .range(0.0, 100.0);
  verb.add_option("--reject-px", options.reject_px, "throw out points that deviate by more, worst first")
      .range(0.0, 1e6);
  verb.add_option("--robust", options.robust,
                  "Cauchy's loss: deviations of many times this, px, count little")
      .range(0.0, 1e6);
  verb.add_option("--output", options.output,
                  "camera JSON to write: internals, and X_WC with --poses; of a rig all cameras by name");
  verb.add_flag("--replace", options.replace, "overwrite --output; the old file is kept as .previous");
  verb.add_option("--report", options.report,
                  "the report as a page (SVG) to write; of a rig one per camera, PAGE-camera.svg");
  verb.add_flag("--json", options.json,
                "one JSON object on stdout: status, reason, camera or cameras, sigma, correlation, views,\n"
                "stage, rms_px, sigma_px, deviations, rejected, diagnosis");
}

}  // namespace

void add_calibrate_views(cli::Verb calibrate, int& exit_status) {
  auto options = std::make_shared<ViewsOptions>();
  const Verb verb = calibrate.add_subcommand(
      "views", "Internals of a camera, or a rig of cameras, from several views of a board");
  add_options(verb, *options);
  verb.footer(help);
  verb.callback([options, &exit_status] {
    exit_status = run([&] { return calibrate_views_of(*options); }, options->json);
  });
}

}  // namespace zeropose
