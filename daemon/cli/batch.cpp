#include "daemon/cli/batch.h"

#include <algorithm>
#include <iostream>
#include <memory>
#include <optional>
#include <sstream>

#include "calib/best_fit.h"
#include "config/cameras.h"
#include "config/cell.h"
#include "config/csv.h"
#include "config/tables.h"
#include "config/text.h"
#include "daemon/cli/answer.h"
#include "daemon/cli/calibrate.h"
#include "daemon/cli/calibration.h"
#include "daemon/cli/convert.h"
#include "daemon/cli/find.h"
#include "daemon/cli/find_board.h"
#include "daemon/cli/find_body.h"
#include "daemon/cli/frame.h"
#include "daemon/cli/help.h"
#include "daemon/cli/network.h"
#include "daemon/cli/plan.h"
#include "daemon/cli/recalibrate.h"
#include "daemon/cli/teach.h"
#include "daemon/cli/triangulate.h"
#include "daemon/cli/verify.h"
#include "measure/pose.h"

namespace zeropose {
namespace {

using namespace cli;

// --- check-config

std::string summary_of(const Cell& cell) {
  std::ostringstream text;
  text << "OK: cell " << cell.name << (cell.simulated ? " (simulated)" : "") << "\n";
  for (const CameraOptions& camera : cell.cameras)
    text << "  camera " << camera.name << " at " << place_of(camera) << ", " << camera.width_px << " x "
         << camera.height_px << " px\n";
  for (const Job& job : cell.jobs) {
    text << "  job " << job.number << " " << job.name << ": ";
    if (job.gaps)
      text << job.gaps->gaps.size() << " gaps\n";
    else if (job.wheel)
      text << "a wheel, " << job.wheel->sensors.size() << " stereo sensors\n";
    else
      text << job.marks.size() << " marks, " << job.views.size() << " views\n";
  }
  for (const RobotOptions& robot : cell.robots)
    text << "  robot " << robot.name << ": " << name_of(robot.convention) << ", " << describe(robot.link)
         << "\n";
  text << "  hashes: config " << hash_text(cell.config_hash) << ", calibration "
       << hash_text(cell.calibration_hash) << "\n";
  return text.str();
}

Answer check_config(const std::string& file) {
  const Cell cell = load_cell(file);
  std::size_t marks = 0;
  for (const Job& job : cell.jobs) marks += job.marks.size();
  Answer answer;
  answer.text = summary_of(cell);
  answer.json = {{"status", "ok"},
                 {"reason", ""},
                 {"cell", cell.name},
                 {"simulated", cell.simulated},
                 {"cameras", cell.cameras.size()},
                 {"jobs", cell.jobs.size()},
                 {"marks", marks},
                 {"robots", cell.robots.size()},
                 {"config_hash", hash_text(cell.config_hash)},
                 {"calibration_hash", hash_text(cell.calibration_hash)}};
  return answer;
}

void add_check_config(cli::Verb app, int& exit_status) {
  struct Options {
    std::string file;
    bool json = false;
  };
  auto options = std::make_shared<Options>();
  const Verb verb =
      app.add_subcommand("check-config", "Checks a cell file and the calibration file that it names");
  verb.add_option("CELL", options->file, "the cell file (JSON, comments allowed)").required();
  verb.add_flag("--json", options->json,
                "one JSON object on stdout: status, reason, mistakes, counts, hashes");
  verb.footer(check_config_help);
  verb.callback([options, &exit_status] {
    exit_status = run([&] { return check_config(options->file); }, options->json);
  });
}

// 6x6, mm and rad.
Json covariance_json(const Matrix6& covariance) {
  Json rows = Json::array();
  for (int row = 0; row < 6; ++row) rows.push_back(json_of(Vector6(covariance.row(row))));
  return rows;
}

// --- bestfit

std::string reason_of(BestFitStatus status) {
  switch (status) {
    case BestFitStatus::too_few_points:
      return "fewer than three points with a weight above 0";
    case BestFitStatus::collinear:
      return "the points lie on a line: the rotation about it is free";
    case BestFitStatus::not_finite:
      return "a number that is not finite";
    default:
      return "no best fit found";
  }
}

Answer best_fit_of(const std::string& file) {
  const std::vector<PointPair> pairs = load_point_pairs(file);
  const BestFitResult result = best_fit(pairs);
  if (result.status != BestFitStatus::ok) return failure(reason_of(result.status));
  Answer answer;
  std::string residuals;
  Json residuals_json = Json::array();
  for (const Eigen::Vector3d& residual : result.residuals_mm) {
    residuals += table_of({residual.data(), 3}) + "\n";
    residuals_json.push_back(json_of(residual));
  }
  const std::array<double, 6> six = six_of(result.X_AB);
  answer.json = {{"status", "ok"},
                 {"reason", ""},
                 {"X_AB", six},
                 {"residuals", residuals_json},
                 {"rms_mm", result.rms_mm},
                 {"sigma_mm", result.sigma_mm},
                 {"covariance", covariance_json(result.covariance)}};
  Vector6 sigma = result.covariance.diagonal().cwiseSqrt();
  sigma.tail<3>() *= degrees_per_radian;
  answer.text = "X_AB, mm and degrees:\n" + table_of(six) + "\nsigma along and about A's axes:\n" +
                table_of({sigma.data(), 6}) + "\nresiduals p_A - X_AB p_B, mm:\n" + residuals +
                "rms, mm:" + table_of({&result.rms_mm, 1}) + "\n";
  return answer;
}

void add_bestfit(cli::Verb app, int& exit_status) {
  struct Options {
    std::string points;
    bool json = false;
  };
  auto options = std::make_shared<Options>();
  const Verb verb =
      app.add_subcommand("bestfit", "The rigid pose between two frames from points known in both");
  verb.add_option("--points", options->points, "CSV with the columns xa ya za xb yb zb [weight], mm")
      .required();
  verb.add_flag("--json", options->json,
                "one JSON object on stdout: status, reason, X_AB [x, y, z, rx, ry, rz], residuals, rms_mm,\n"
                "sigma_mm, covariance (6x6, mm and rad)");
  verb.footer(bestfit_help);
  verb.callback([options, &exit_status] {
    exit_status = run([&] { return best_fit_of(options->points); }, options->json);
  });
}

// --- pose

struct PoseOptions {
  std::string cameras, marks, observations;
  std::optional<std::string> start, planar;
  double system_sigma_px = 0;
  std::string residual = "reprojection";
  bool json = false;
};

Json name_json(const PoseInput& input, const Observation& observation) {
  return {{"camera", input.cameras[observation.camera].name}, {"mark", input.marks[observation.mark].name}};
}

Json deviation_json(const PoseInput& input, std::size_t index, const Deviation& deviation) {
  const Observation& observation = input.observations[index];
  Json json = name_json(input, observation);
  json["u_px"] = observation.u_px.x();
  json["v_px"] = observation.u_px.y();
  json["dev_px"] = json_of(deviation.dev_px);
  json["dev_mm"] = json_of(deviation.dev_mm);
  json["normalised"] = deviation.normalised;
  json["used"] = deviation.used;
  json["removed"] = deviation.removed;
  return json;
}

Json pose_json(const PoseInput& input, const PoseResult& result) {
  const bool good = result.code == Code::ok;
  Json json = {{"status", good ? "ok" : "failed"},
               {"reason", result.reason},
               {"code", static_cast<int>(result.code)},
               {"name", text_of(result.code).name}};
  // No number that could be taken for a pose unless it is one.
  json["X_WO"] = good ? Json(six_of(result.X_WO)) : Json();
  json["covariance"] = good ? covariance_json(result.covariance) : Json();
  json["alternatives"] = Json::array();
  for (const Pose& X_WO : result.alternatives) json["alternatives"].push_back(six_of(X_WO));
  json["deviations"] = Json::array();
  for (std::size_t i = 0; i < result.deviations.size(); ++i)
    json["deviations"].push_back(deviation_json(input, i, result.deviations[i]));
  json["removed"] = Json::array();
  for (const std::size_t index : result.removed)
    json["removed"].push_back(name_json(input, input.observations[index]));
  json["effective_marks"] = result.effective_marks;
  json["effective_cameras"] = result.effective_cameras;
  json["redundancy"] = result.redundancy;
  return json;
}

std::string pose_text(const PoseInput& input, const PoseResult& result) {
  if (result.code != Code::ok)
    return concat({"no answer: code ", std::to_string(static_cast<int>(result.code)), " ",
                   text_of(result.code).name, ": ", result.reason, "\n"});
  Vector6 sigma = result.covariance.diagonal().cwiseSqrt();
  sigma.tail<3>() *= degrees_per_radian;
  std::ostringstream text;
  text << "X_WO, mm and degrees:\n"
       << table_of(six_of(result.X_WO)) << "\nsigma along and about the world's axes:\n"
       << table_of({sigma.data(), 6}) << "\n"
       << result.effective_marks << " marks in " << result.effective_cameras << " cameras, redundancy "
       << result.redundancy << "\ndeviations, px and mm:\n";
  for (std::size_t i = 0; i < result.deviations.size(); ++i) {
    const Deviation& deviation = result.deviations[i];
    text << table_of({deviation.dev_px.data(), 2}) << table_of({deviation.dev_mm.data(), 2}) << "  "
         << input.cameras[input.observations[i].camera].name << " "
         << input.marks[input.observations[i].mark].name
         << (deviation.removed ? "  removed as wrong"
             : deviation.used  ? ""
                               : "  not used")
         << "\n";
  }
  return text.str();
}

Answer estimate(const PoseOptions& options) {
  PoseProblem problem;
  problem.X_WO_start = pose_of_option(options.start, "--start");
  problem.X_WP_planar = pose_of_option(options.planar, "--planar");
  problem.system_sigma_px = options.system_sigma_px;
  problem.residual = options.residual == "algebraic" ? Residual::algebraic : Residual::reprojection;
  const PoseInput input = load_pose_input(options.cameras, options.marks, options.observations);
  problem.cameras = input.cameras;
  problem.marks = input.marks;
  problem.observations = input.observations;
  const PoseResult result = estimate_pose(problem);
  return {result.code == Code::ok ? done : no_answer, pose_json(input, result), pose_text(input, result)};
}

void add_pose_options(cli::Verb verb, PoseOptions& options) {
  verb.add_option("--cameras", options.cameras, "JSON {\"name\": camera, ...} with model, internals and X_WC")
      .required();
  verb.add_option("--marks", options.marks,
                  "CSV: mark x_mm y_mm z_mm [weight tolerance_px tolerance_mm sigma_mm]")
      .required();
  verb.add_option("--observations", options.observations, "CSV: camera mark u_px v_px [suu svv suv]")
      .required();
  verb.add_option("--start", options.start, "x,y,z,rx,ry,rz to start from; without it from any pose");
  verb.add_option("--planar", options.planar,
                  "x,y,z,rx,ry,rz of a plane in the world: only x, y, rz in it are free, 2 marks suffice");
  verb.add_option("--system-sigma-px", options.system_sigma_px, "calibration errors that remain, in px (0)")
      .range(0.0, 100.0);
  verb.add_option("--residual", options.residual, "what is minimised (reprojection)")
      .one_of({"reprojection", "algebraic"});
  verb.add_flag(
      "--json", options.json,
      "one JSON object on stdout: status, reason, code, X_WO [x, y, z, rx, ry, rz], covariance (6x6, mm and\n"
      "rad), deviations, removed, effective_marks, effective_cameras, redundancy");
}

void add_pose(cli::Verb app, int& exit_status) {
  auto options = std::make_shared<PoseOptions>();
  const Verb verb =
      app.add_subcommand("pose", "The pose of an object from marks found in any number of cameras");
  add_pose_options(verb, *options);
  verb.footer(pose_help);
  verb.callback(
      [options, &exit_status] { exit_status = run([&] { return estimate(*options); }, options->json); });
}

}  // namespace

void add_batch_verbs(cli::Verb app, int& exit_status) {
  add_check_config(app, exit_status);
  add_pose(app, exit_status);
  add_bestfit(app, exit_status);
  add_calibrate(app, exit_status);
  add_convert(app, exit_status);
  add_find(app, exit_status);
  add_find_board(app, exit_status);
  add_find_body(app, exit_status);
  add_frame(app, exit_status);
  add_network(app, exit_status);
  add_plan(app, exit_status);
  add_triangulate(app, exit_status);
  add_teach(app, exit_status);
  add_verify(app, exit_status);
  add_recalibrate(app, exit_status);
  add_calibration(app, exit_status);
}

}  // namespace zeropose
