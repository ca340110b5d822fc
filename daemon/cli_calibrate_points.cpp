#include <algorithm>
#include <cmath>
#include <iostream>
#include <memory>
#include <sstream>

#include "calib/calibration.h"
#include "calib/comparison.h"
#include "calib/data_sheet.h"
#include "calib/uncertainty.h"
#include "calib/verdict.h"
#include "config/atomic_file.h"
#include "config/calibration_page.h"
#include "config/calibration_rows.h"
#include "config/calibration_tables.h"
#include "config/camera_file.h"
#include "config/csv.h"
#include "config/svg.h"
#include "config/text.h"
#include "daemon/cli_answer.h"
#include "daemon/cli_calibrate.h"
#include "daemon/cli_calibrate_help.h"
#include "daemon/cli_convert.h"
#include "daemon/cli_output.h"

namespace zeropose {
namespace {

using namespace cli;

struct PointsOptions {
  std::string points, method = "auto", refine = "auto", residual = "reprojection", model, start, active, name;
  std::string output, report, report_json, angles = "deg";
  std::optional<std::string> origin;
  std::optional<double> tz_mm;
  std::vector<std::string> fix;
  int width_px = 0, height_px = 0;
  double reject_px = 0, reject_mm = 0, sigma_px = 0, pitch_mm = 0, frame_offset_z_mm = 0;
  bool search_origin = false, one_focal = false, replace = false, json = false;
};

// What calibrate() borrows, and the files beside it.
struct PointsInput {
  std::vector<CalibrationPoint> points;
  CalibrationProblem problem;
  std::optional<CalibratedCamera> active;
};

template <typename Value>
Value chosen(const std::string& word, std::initializer_list<std::pair<const char*, Value>> choices) {
  for (const auto& [name, value] : choices)
    if (word == name) return value;
  return choices.begin()->second;
}

ParameterSet fixed_set(const std::vector<std::string>& words) {
  ParameterSet fixed;
  for (const std::string& word : words) {
    if (word == "pose")
      fixed.add(pose_parameters);
    else if (word == "distortion")
      fixed.add(lens_parameters);
    else if (word == "origin")
      fixed.add({Parameter::cx, Parameter::cy});
    else if (word == "focal")
      fixed.add({Parameter::fx, Parameter::fy});
    else if (const auto parameter = parameter_named(word))
      fixed.add(*parameter);
    else
      throw std::invalid_argument(
          concat({"--fix: found ", in_quotes(word),
                  ", expected fx fy cx cy K k1 k2 p1 p2 k3 x y z rx ry rz pose origin focal distortion"}));
  }
  return fixed;
}

void read_start(const PointsOptions& options, CalibrationProblem& problem) {
  if (!options.start.empty()) {
    const CameraFile file = load_camera(options.start, options.name);
    problem.start = CalibrationStart{file.camera.model, {}};
    if (file.has_pose) problem.start->X_WC = file.camera.X_WC;
    problem.width_px = file.camera.model.width_px;
    problem.height_px = file.camera.model.height_px;
    if (std::holds_alternative<BrownConrady>(file.camera.model.distortion)) problem.lens = LensModel::brown;
  }
  if (options.width_px > 0) problem.width_px = options.width_px;
  if (options.height_px > 0) problem.height_px = options.height_px;
  if (problem.width_px <= 0 || problem.height_px <= 0)
    throw std::invalid_argument("--width and --height are required (or --start, which states them)");
}

std::unique_ptr<PointsInput> input_of(const PointsOptions& options) {
  auto input = std::make_unique<PointsInput>();
  CalibrationProblem& problem = input->problem;
  input->points = load_calibration_points(options.points);
  problem.points = input->points;
  read_start(options, problem);
  if (!options.active.empty()) input->active = load_camera(options.active, options.name).camera;
  if (!options.model.empty())
    problem.lens = options.model == "brown" ? LensModel::brown : LensModel::division;
  problem.method = chosen<CalibrationMethod>(options.method, {{"auto", CalibrationMethod::automatic},
                                                              {"coplanar", CalibrationMethod::coplanar},
                                                              {"noncoplanar", CalibrationMethod::noncoplanar},
                                                              {"linear", CalibrationMethod::linear}});
  problem.refinement =
      chosen<Refinement>(options.refine, {{"auto", Refinement::automatic},
                                          {"none", Refinement::none},
                                          {"joint", Refinement::joint},
                                          {"distortion-dominant", Refinement::distortion_dominant},
                                          {"origin-dominant", Refinement::origin_dominant}});
  problem.residual = options.residual == "algebraic" ? Residual::algebraic : Residual::reprojection;
  problem.fixed = fixed_set(options.fix);
  problem.one_focal = options.one_focal;
  problem.search_origin = options.search_origin;
  problem.tz_mm = options.tz_mm;
  problem.reject_px = options.reject_px;
  problem.reject_mm = options.reject_mm;
  problem.sigma_px = options.sigma_px;
  if (options.origin) problem.origin_px = point_of_option(*options.origin, "--origin");
  return input;
}

void refuse_contradictions(const PointsOptions& options) {
  if (!options.output.empty() && options.frame_offset_z_mm != 0)
    throw std::invalid_argument(
        "--output with --frame-offset-z-mm: a camera with a moved frame must not be used for measuring; take "
        "the moved pose from --json");
  if (!options.output.empty()) refuse_existing(options.output, options.replace);
}

Json uncertainty_json(const ReportedUncertainty& uncertainty, Json& correlation) {
  Json sigma = Json::object();
  correlation = Json::object();
  for (std::size_t i = 0; i < uncertainty.parameters.size(); ++i) {
    const std::string name(name_of(uncertainty.parameters[i]));
    sigma[name] = uncertainty.sigma(static_cast<Eigen::Index>(i));
    for (std::size_t j = 0; j < uncertainty.parameters.size(); ++j)
      correlation[name][std::string(name_of(uncertainty.parameters[j]))] =
          uncertainty.correlation(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j));
  }
  return sigma;
}

Json data_sheet_json(const CameraModel& model, double pitch_mm) {
  const DataSheet sheet = data_sheet(model, pitch_mm);
  return {{"f", sheet.f_mm},
          {"Sx", sheet.sx_mm},
          {"Sy", sheet.sy_mm},
          {"k", sheet.k_per_mm2},
          {"origin_from_centre", json_of(sheet.origin_from_centre_px)}};
}

Json deviations_json(const PointsInput& input, const CalibrationResult& result) {
  Json deviations = Json::array();
  for (std::size_t i = 0; i < result.deviations.size(); ++i) {
    const CalibrationDeviation& deviation = result.deviations[i];
    deviations.push_back({{"u_px", input.points[i].u_px.x()},
                          {"v_px", input.points[i].u_px.y()},
                          {"dev_px", json_of(deviation.dev_px)},
                          {"dev_mm", json_of(deviation.dev_mm)},
                          {"depth_mm", deviation.depth_mm},
                          {"used", deviation.used}});
  }
  return deviations;
}

Json verdict_json(const Verdict& verdict) {
  Json findings = Json::array();
  for (const Finding& finding : verdict.findings)
    findings.push_back({{"quality", name_of(finding.quality)}, {"text", finding.text}});
  return {{"quality", name_of(verdict.quality)}, {"summary", verdict.summary}, {"findings", findings}};
}

Json coverage_json(const Coverage& coverage) {
  return {{"image_area", coverage.area},
          {"reach", coverage.reach},
          {"depth_min_mm", coverage.depth_min_mm},
          {"depth_max_mm", coverage.depth_max_mm}};
}

Json comparison_json(const PointsInput& input, const CalibrationResult& result) {
  const Coverage coverage = coverage_of(input.problem, result);
  const double depth_mm = (coverage.depth_min_mm + coverage.depth_max_mm) / 2;
  const CameraComparison comparison = compare(*input.active, {"", result.model, result.X_WC}, depth_mm);
  Json json = {{"depth_mm", depth_mm},
               {"worst_internals_px", comparison.worst_internals_px},
               {"worst_camera_px", comparison.worst_camera_px},
               {"moved_mm", comparison.moved_mm},
               {"turned_deg", comparison.turned_deg}};
  for (const ParameterRow& row : parameter_rows(result, 0, input.active))
    if (row.active) json["difference"][std::string(name_of(row.parameter))] = row.value - *row.active;
  for (const PixelShift& shift : comparison.shifts)
    json["shifts"].push_back({{"at_px", json_of(shift.at_px)},
                              {"internals_px", shift.internals_px ? json_of(*shift.internals_px) : Json()},
                              {"camera_px", shift.camera_px ? json_of(*shift.camera_px) : Json()}});
  return json;
}

Json diagnosis_json(const CalibrationDiagnosis& diagnosis) {
  return {
      {"condition", diagnosis.condition}, {"coplanar", diagnosis.coplanar}, {"warnings", diagnosis.warnings}};
}

Json steps_json(const CalibrationResult& result) {
  Json steps = Json::array();
  for (const CalibrationStep& step : result.steps)
    steps.push_back({{"name", step.name}, {"detail", step.detail}, {"rms_px", step.rms_px}});
  return steps;
}

Json result_json(const PointsOptions& options, const PointsInput& input, const CalibrationResult& result) {
  const Pose X_WC = with_frame_offset(result.X_WC, options.frame_offset_z_mm);
  Json json = {{"status", "ok"}, {"reason", ""}};
  json["camera"] = Json::parse(camera_text({"", result.model, X_WC}));
  json["X_CW"] = six_of(X_WC.inverse());
  json["frame_offset_z_mm"] = options.frame_offset_z_mm;
  if (options.pitch_mm > 0) json["data_sheet"] = data_sheet_json(result.model, options.pitch_mm);
  Json correlation;
  json["sigma"] = uncertainty_json(
      reported_uncertainty(result.uncertainty, result.X_WC, options.frame_offset_z_mm), correlation);
  json["correlation"] = correlation;
  json["sigma_px"] = result.sigma_px;
  json["rms_px"] = result.rms_px;
  json["residual_sum"] = result.residual_sum;
  json["verdict"] = verdict_json(judge(input.problem, result));
  json["coverage"] = coverage_json(coverage_of(input.problem, result));
  if (input.active) json["comparison"] = comparison_json(input, result);
  json["deviations"] = deviations_json(input, result);
  json["steps"] = steps_json(result);
  json["diagnosis"] = diagnosis_json(result.diagnosis);
  return json;
}

void print_parameters(std::ostream& text, const PointsOptions& options, const PointsInput& input,
                      const CalibrationResult& result) {
  const bool rad = options.angles == "rad";
  text << "parameter          value      1 sigma" << (input.active ? "       active   difference" : "")
       << "\n";
  for (const ParameterRow& row : parameter_rows(result, options.frame_offset_z_mm, input.active)) {
    const bool angle = row.unit == "deg";
    const double unit = angle && rad ? 1 / degrees_per_radian : 1;
    const int digits = row.decimals + (angle && rad ? 2 : 0);
    const auto cell = [&](double value) { text << std::setw(13) << fixed_text(value * unit, digits); };
    text << std::left << std::setw(11)
         << concat({name_of(row.parameter), " ", angle && rad ? "rad" : row.unit}) << std::right;
    cell(row.value);
    if (row.sigma < 0)
      text << std::setw(13) << "held";
    else
      cell(row.sigma);
    if (row.active) {
      cell(*row.active);
      cell(row.value - *row.active);
    }
    text << "\n";
  }
  text << "X_CW, mm and degrees:\n"
       << table_of(six_of(with_frame_offset(result.X_WC, options.frame_offset_z_mm).inverse())) << "\n";
  if (options.frame_offset_z_mm != 0)
    text << "The camera's frame is moved by " << options.frame_offset_z_mm
         << " mm along its z axis: not for measuring.\n";
  if (!(options.pitch_mm > 0)) return;
  const DataSheet sheet = data_sheet(result.model, options.pitch_mm);
  text << "data sheet: f " << fixed_text(sheet.f_mm, 3) << " mm, Sx " << fixed_text(sheet.sx_mm, 6)
       << " mm, Sy " << fixed_text(sheet.sy_mm, 6) << " mm, k " << fixed_text(sheet.k_per_mm2, 7)
       << " /mm^2, origin from the centre " << fixed_text(sheet.origin_from_centre_px.x(), 2) << ", "
       << fixed_text(sheet.origin_from_centre_px.y(), 2) << " px\n";
}

void print_worst_points(std::ostream& text, const PointsInput& input, const CalibrationResult& result) {
  std::vector<std::size_t> order(result.deviations.size());
  for (std::size_t i = 0; i < order.size(); ++i) order[i] = i;
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    return result.deviations[a].dev_px.norm() > result.deviations[b].dev_px.norm();
  });
  text << "worst points: no., u v, deviation in u v, px, in x y, mm\n";
  for (std::size_t i = 0; i < std::min<std::size_t>(5, order.size()); ++i) {
    const CalibrationDeviation& deviation = result.deviations[order[i]];
    text << std::setw(5) << order[i] + 1 << table_of({input.points[order[i]].u_px.data(), 2}, 2)
         << table_of({deviation.dev_px.data(), 2}, 3) << table_of({deviation.dev_mm.data(), 2}, 3)
         << (deviation.used ? "" : "  rejected") << "\n";
  }
}

std::string result_text(const PointsOptions& options, const PointsInput& input,
                        const CalibrationResult& result) {
  std::ostringstream text;
  const Verdict verdict = judge(input.problem, result);
  text << verdict.summary << "\n";
  for (const Finding& finding : verdict.findings)
    text << "  " << std::left << std::setw(11) << name_of(finding.quality) << std::right << finding.text
         << "\n";
  for (const std::string& warning : result.diagnosis.warnings) text << "warning: " << warning << "\n";
  text << "\n";
  print_parameters(text, options, input, result);
  text << "\nsteps:\n";
  for (const CalibrationStep& step : result.steps)
    text << "  " << step.name << (step.detail.empty() ? "" : ": ") << step.detail << ", RMS "
         << fixed_text(step.rms_px, 4) << " px\n";
  print_worst_points(text, input, result);
  if (!options.output.empty()) text << "written: " << options.output << "\n";
  if (!options.report.empty()) text << "written: " << options.report << "\n";
  return text.str();
}

void write_files(const PointsOptions& options, const PointsInput& input, const CalibrationResult& result,
                 const Json& json) {
  if (!options.report.empty()) {
    const CalibrationReport report{
        input.problem,    result,
        options.name,     concat({"Points: ", std::filesystem::path(options.points).filename().string()}),
        options.pitch_mm, options.frame_offset_z_mm,
        input.active};
    replace_file(options.report, calibration_page(report));
  }
  if (!options.report_json.empty()) replace_file(options.report_json, json.dump(1) + "\n");
  if (!options.output.empty())
    replace_file(options.output, camera_file_text({{options.name, result.model, result.X_WC}, true}));
}

Answer calibrate_points(const PointsOptions& options) {
  refuse_contradictions(options);
  const auto input = input_of(options);
  const CalibrationResult result = calibrate(input->problem);
  if (result.status != CalibrationStatus::ok) {
    Answer answer = failure(concat({name_of(result.status), ": ", result.reason}));
    answer.json["diagnosis"] = diagnosis_json(result.diagnosis);
    answer.json["steps"] = steps_json(result);
    return answer;
  }
  Answer answer;
  answer.json = result_json(options, *input, result);
  write_files(options, *input, result, answer.json);
  answer.text = result_text(options, *input, result);
  return answer;
}

void add_problem_options(CLI::App& verb, PointsOptions& options) {
  verb.add_option("--points", options.points, "CSV: x_mm y_mm z_mm u_px v_px")->required();
  verb.add_option("--width", options.width_px, "of the image, px")->check(CLI::Range(1, 65535));
  verb.add_option("--height", options.height_px, "of the image, px")->check(CLI::Range(1, 65535));
  verb.add_option("--method", options.method, "the linear method that begins (auto)")
      ->check(CLI::IsMember({"auto", "coplanar", "noncoplanar", "linear"}));
  verb.add_option("--refine", options.refine, "the refinement (auto: by the number of points)")
      ->check(CLI::IsMember({"auto", "none", "joint", "distortion-dominant", "origin-dominant"}));
  verb.add_option("--residual", options.residual, "what is minimised (reprojection)")
      ->check(CLI::IsMember({"reprojection", "algebraic"}));
  verb.add_option("--model", options.model, "lens model (division, or as --start)")
      ->check(CLI::IsMember({"division", "brown"}));
  verb.add_option("--fix", options.fix, "parameters to hold, e.g. cx,cy or pose")->delimiter(',');
  verb.add_option("--start", options.start, "camera JSON to start from; its pose too, where it has one");
  verb.add_option("--origin", options.origin, "CX,CY: image origin to begin with or to hold");
  verb.add_flag("--search-origin", options.search_origin, "search the image origin in any case");
  verb.add_option("--reject-px", options.reject_px, "drop points that deviate by more, worst first")
      ->check(CLI::Range(0.0, 1e6));
  verb.add_option("--reject-mm", options.reject_mm, "the same in mm at the point's distance")
      ->check(CLI::Range(0.0, 1e6));
  verb.add_flag("--one-focal", options.one_focal, "fx = fy");
  verb.add_option("--sigma-px", options.sigma_px, "noise of one pixel coordinate")
      ->check(CLI::Range(0.0, 1e3));
  verb.add_option("--tz-mm", options.tz_mm, "distance of a board parallel to the chip")
      ->check(CLI::Range(1e-3, 1e6));
}

void add_answer_options(CLI::App& verb, PointsOptions& options) {
  verb.add_option("--pitch-mm", options.pitch_mm, "pixel pitch Sy: adds the data-sheet form")
      ->check(CLI::Range(1e-6, 1.0));
  verb.add_option("--frame-offset-z-mm", options.frame_offset_z_mm,
                  "the camera's frame in the answer moved along its z axis")
      ->check(CLI::Range(-1e5, 1e5));
  verb.add_option("--angles", options.angles, "of the text for people (deg)")
      ->check(CLI::IsMember({"deg", "rad"}));
  verb.add_option("--active", options.active, "camera JSON in use, to compare with");
  verb.add_option("--name", options.name, "of the camera; which one of --start and --active is meant");
  verb.add_option("--output", options.output, "the camera JSON to write");
  verb.add_flag("--replace", options.replace, "overwrite --output; the old file is kept as .previous");
  verb.add_option("--report", options.report, "the report as a page (SVG) to write");
  verb.add_option("--report-json", options.report_json, "the report as JSON to write");
  verb.add_flag("--json", options.json,
                "one JSON object on stdout: status, reason, camera, data_sheet, sigma, correlation, rms_px,\n"
                "residual_sum, deviations, steps, diagnosis, verdict, coverage, comparison");
}

}  // namespace

void add_calibrate_points(CLI::App& calibrate, int& exit_status) {
  auto options = std::make_shared<PointsOptions>();
  CLI::App* verb = calibrate.add_subcommand("points", "One camera from known points and their pixels");
  add_problem_options(*verb, *options);
  add_answer_options(*verb, *options);
  verb->footer(calibrate_points_help);
  verb->callback([options, &exit_status] {
    exit_status = run([&] { return calibrate_points(*options); }, options->json);
  });
}

}  // namespace zeropose
