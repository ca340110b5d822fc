#include "daemon/cli/points_options.h"

#include "config/atomic_file.h"
#include "config/calibration_page.h"
#include "config/camera_file.h"
#include "config/text.h"
#include "daemon/cli/calibration_answer.h"
#include "daemon/cli/convert.h"
#include "daemon/cli/output.h"

namespace zeropose {

using namespace cli;

namespace {

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

}  // namespace

std::unique_ptr<PointsInput> cli::input_of(const PointsOptions& options,
                                           std::vector<CalibrationPoint> points) {
  auto input = std::make_unique<PointsInput>();
  CalibrationProblem& problem = input->problem;
  input->points = std::move(points);
  problem.points = input->points;
  read_start(options, problem);
  if (!options.active.empty()) {
    const CameraFile active = load_camera(options.active, options.name);
    if (!active.has_pose)
      throw ConfigError(
          {concat({options.active, ": found no X_WC, expected it: a camera in use has a pose"})});
    input->active = active.camera;
  }
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
  problem.robust = options.robust;
  if (options.origin) problem.origin_px = point_of_option(*options.origin, "--origin");
  return input;
}

void cli::refuse_contradictions(const PointsOptions& options) {
  if (!options.output.empty() && options.frame_offset_z_mm != 0)
    throw std::invalid_argument(
        "--output with --frame-offset-z-mm: a camera with a moved frame must not be used for measuring; take "
        "the moved pose from --json");
  if (!options.output.empty()) refuse_existing(options.output, options.replace);
}

namespace {

void write_files(const PointsOptions& options, const CalibrationReport& report, Answer& answer) {
  const auto write = [&answer](const std::string& file, const std::string& bytes) {
    if (file.empty()) return;
    replace_file(file, bytes);
    answer.text += concat({"written: ", file, "\n"});
  };
  if (!options.report.empty()) write(options.report, calibration_page(report));
  if (!options.report_json.empty()) write(options.report_json, answer.json.dump(1) + "\n");
  if (!options.output.empty())
    write(options.output,
          camera_file_text({{options.name, report.result.model, report.result.X_WC, options.on_hand}, true}));
}

}  // namespace

Answer cli::answer_of(const PointsOptions& options, const PointsInput& input, const CalibrationResult& result,
                      const std::string& source) {
  const CalibrationReport report{
      input.problem, result, options.name, source, options.pitch_mm, options.frame_offset_z_mm,
      input.active,  0,      options.pose};
  Answer answer;
  answer.json = calibration_json(report);
  answer.text = calibration_text(report, options.angles == "rad");
  write_files(options, report, answer);
  return answer;
}

void cli::add_problem_options(cli::Verb verb, PointsOptions& options) {
  verb.add_option("--width", options.width_px, "of the image, px").range(1, 65535);
  verb.add_option("--height", options.height_px, "of the image, px").range(1, 65535);
  verb.add_option("--method", options.method, "the linear method that begins (auto)")
      .one_of({"auto", "coplanar", "noncoplanar", "linear"});
  verb.add_option("--refine", options.refine, "the refinement (auto: by the number of points)")
      .one_of({"auto", "none", "joint", "distortion-dominant", "origin-dominant"});
  verb.add_option("--residual", options.residual, "what is minimised (reprojection)")
      .one_of({"reprojection", "algebraic"});
  verb.add_option("--model", options.model, "lens model (division, or as --start)")
      .one_of({"division", "brown"});
  verb.add_option("--fix", options.fix, "parameters to hold, e.g. cx,cy or pose").delimiter(',');
  verb.add_option("--start", options.start, "camera JSON to start from; its pose too, where it has one");
  verb.add_option("--origin", options.origin, "CX,CY: image origin to begin with or to hold");
  verb.add_flag("--search-origin", options.search_origin, "search the image origin in any case");
  verb.add_option("--reject-px", options.reject_px, "drop points that deviate by more, worst first")
      .range(0.0, 1e6);
  verb.add_option("--reject-mm", options.reject_mm, "the same in mm at the point's distance").range(0.0, 1e6);
  verb.add_flag("--one-focal", options.one_focal, "fx = fy");
  verb.add_option("--sigma-px", options.sigma_px, "noise of one pixel coordinate").range(0.0, 1e3);
  verb.add_option("--robust", options.robust,
                  "Cauchy's loss from this many px (or sigmas) on: wrong points pull less")
      .range(0.0, 1e3);
  verb.add_option("--tz-mm", options.tz_mm, "distance of a board parallel to the chip").range(1e-3, 1e6);
}

void cli::add_answer_options(cli::Verb verb, PointsOptions& options) {
  verb.add_option("--pitch-mm", options.pitch_mm, "pixel pitch Sy: adds the data-sheet form")
      .range(1e-6, 1.0);
  verb.add_option("--frame-offset-z-mm", options.frame_offset_z_mm,
                  "the camera's frame in the answer moved along its z axis")
      .range(-1e5, 1e5);
  verb.add_option("--angles", options.angles, "of the text for people (deg)").one_of({"deg", "rad"});
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

}  // namespace zeropose
