#include <algorithm>
#include <array>
#include <filesystem>
#include <memory>
#include <optional>
#include <sstream>

#include "calib/frame_fit.h"
#include "config/atomic_file.h"
#include "config/body_tables.h"
#include "config/calibration_tables.h"
#include "config/camera_file.h"
#include "config/svg.h"
#include "config/text.h"
#include "daemon/cli/calibrate.h"
#include "daemon/cli/calibration_answer.h"
#include "daemon/cli/find_body.h"
#include "daemon/cli/output.h"
#include "daemon/cli/points_options.h"

namespace zeropose {
namespace {

using namespace cli;

constexpr const char* calibrate_body_help =
    R"(One camera from a picture of a calibration body (see find-body), or from the points that find-body --csv wrote. All
options of calibrate points, but --refine is joint unless it is given; X_BC is the camera's pose in the body. Without --start the internals need not be known.
control.csv: columns [mark] xa ya za xb yb zb [weight], the body's control marks as the measuring system sees them
(A: the world W) and in the body (B): X_WB by best fit, X_WC = X_WB X_BC, and the camera that is answered and written
stands in the world. Without --control it stands in the body's frame. A control mark that contradicts the others is
left out and named where the others check each other; --control-sigma-mm is the uncertainty of one coordinate, of
measuring system and body together.
Examples:
  zeropose calibrate body --image body.png --body body.csv --radius-mm 8 --focal-px 4200 --control control.csv \
      --output camera.json
  zeropose calibrate body --points points.csv --width 768 --height 572 --json
Exit status: 0 done, 1 no body or no calibration (status and reason say why), 2 wrong usage or unreadable input.)";

struct Options {
  PointsOptions points;
  BodyOptions body;
  std::string control;
  double control_sigma_mm = 0.05;
};

struct Control {
  std::vector<ControlMark> marks;
  FrameFitResult fit;
};

struct Calibrated {
  Answer answer;
  CalibrationResult result;
};

Calibrated calibrated(const PointsOptions& options, std::vector<CalibrationPoint> points,
                      const std::string& source) {
  const auto input = input_of(options, std::move(points));
  Calibrated found{{}, calibrate(input->problem)};
  found.answer = found.result.status == CalibrationStatus::ok
                     ? answer_of(options, *input, found.result, source)
                     : calibration_failure(found.result);
  return found;
}

Control control_of(const Options& options) {
  Control control{load_control_marks(options.control), {}};
  const double variance = options.control_sigma_mm * options.control_sigma_mm;
  std::vector<MeasuredPair> pairs;
  for (const ControlMark& mark : control.marks)
    pairs.push_back({mark.pair.p_A_mm, mark.pair.p_B_mm,
                     variance / mark.pair.weight * Eigen::Matrix3d::Identity(), Eigen::Matrix3d::Zero()});
  control.fit = fit_frames(pairs);
  return control;
}

Json control_json(const Control& control) {
  Json json = {
      {"what", name_of(control.fit.status)}, {"rms_mm", control.fit.rms_mm}, {"marks", Json::array()}};
  for (std::size_t i = 0; i < control.fit.residuals_mm.size(); ++i) {
    const auto is_in = [i](const std::vector<std::size_t>& list) {
      return std::find(list.begin(), list.end(), i) != list.end();
    };
    json["marks"].push_back({{"mark", control.marks[i].name},
                             {"residual_mm", json_of(control.fit.residuals_mm[i])},
                             {"removed", is_in(control.fit.removed)},
                             {"suspect", is_in(control.fit.suspects)}});
  }
  return json;
}

std::string names_of(const Control& control, const std::vector<std::size_t>& list) {
  std::string text;
  for (const std::size_t i : list) text += (text.empty() ? "" : ", ") + control.marks[i].name;
  return text;
}

// By name, where the fit speaks of numbers.
std::string reason_of(const Control& control) {
  if (control.fit.suspects.empty()) return concat({"control marks: ", control.fit.reason});
  return concat({"the control marks contradict each other, wrong is one of: ",
                 names_of(control, control.fit.suspects)});
}

// The delta of the pose; nothing where a part of the pose was held.
std::optional<Matrix6> pose_covariance(const CalibrationResult& result) {
  Matrix6 covariance = Matrix6::Zero();
  std::array<Eigen::Index, 6> at{};
  const auto& free = result.uncertainty.parameters;
  constexpr std::array numbers{Parameter::x,  Parameter::y,  Parameter::z,
                               Parameter::rx, Parameter::ry, Parameter::rz};
  for (std::size_t k = 0; k < 6; ++k) {
    const auto found = std::find(free.begin(), free.end(), numbers[k]);
    if (found == free.end()) return std::nullopt;
    at[k] = found - free.begin();
  }
  for (std::size_t i = 0; i < 6; ++i)
    for (std::size_t k = 0; k < 6; ++k)
      covariance(Eigen::Index(i), Eigen::Index(k)) = result.uncertainty.covariance(at[i], at[k]);
  return covariance;
}

Json sigma_json(const Matrix6& covariance) {
  Vector6 sigma = covariance.diagonal().cwiseSqrt();
  sigma.tail<3>() *= degrees_per_radian;
  return json_of(sigma);
}

// X_WC from body and control marks, into the answer and the camera's file.
void add_world(const Options& options, const Control& control, Calibrated& found) {
  const UncertainPose X_WB{control.fit.X_AB, control.fit.covariance};
  const auto covariance = pose_covariance(found.result);
  const UncertainPose X_WC = chain(X_WB, {found.result.X_WC, covariance.value_or(Matrix6::Zero())});
  Answer& answer = found.answer;
  answer.json["camera"]["X_WC"] = six_of(X_WC.X);
  answer.json["X_WB"] = six_of(X_WB.X);
  answer.json["X_WC"] = six_of(X_WC.X);
  answer.json["sigma_X_WB"] = sigma_json(X_WB.covariance);
  answer.json["sigma_X_WC"] = covariance ? sigma_json(X_WC.covariance) : Json();
  answer.json["control"] = control_json(control);
  std::ostringstream text;
  text << "X_WB, mm and degrees, from " << control.marks.size() - control.fit.removed.size()
       << " control marks (" << fixed_text(control.fit.rms_mm, 4) << " mm rms):\n"
       << table_of(six_of(X_WB.X)) << "\nX_WC = X_WB X_BC:\n"
       << table_of(six_of(X_WC.X)) << "\n";
  if (!control.fit.removed.empty())
    text << "left out, contradicts the other control marks: " << names_of(control, control.fit.removed)
         << "\n";
  if (!options.points.output.empty()) {
    replace_file(options.points.output,
                 camera_file_text({{options.points.name, found.result.model, X_WC.X}, true}));
    text << "written: " << options.points.output << "\n";
  }
  answer.text += text.str();
}

Answer without_control(const Control& control) {
  Answer answer = failure(reason_of(control));
  answer.json["control"] = control_json(control);
  return answer;
}

std::vector<CalibrationPoint> points_of(Options& options, std::optional<FoundBody>& body) {
  if (options.body.image.empty()) return load_calibration_points(options.points.points);
  body = find_body_in(options.body);
  options.points.width_px = body->width_px;
  options.points.height_px = body->height_px;
  return calibration_points(*body);
}

Answer calibrate_body(Options options) {
  if (!options.body.image.empty() && options.body.body.empty())
    throw std::invalid_argument("--body is required with --image");
  if (options.body.image.empty() && options.points.points.empty())
    throw std::invalid_argument("--image or --points is required");
  const std::string source = options.body.image.empty() ? options.points.points : options.body.image;
  refuse_contradictions(options.points);
  std::optional<FoundBody> body;
  std::vector<CalibrationPoint> points = points_of(options, body);
  if (body && body->result.status != BodyStatus::found)
    return {no_answer, body_json(*body), concat({"no answer: ", body->result.reason, "\n"})};
  std::optional<Control> control;
  if (!options.control.empty()) {
    control = control_of(options);
    if (control->fit.status != FrameFitStatus::ok) return without_control(*control);
  }
  PointsOptions in_body = options.points;
  in_body.pose = "X_BC";
  if (control) in_body.output.clear();  // written with the pose in the world
  Calibrated found = calibrated(in_body, std::move(points),
                                concat({"Body: ", std::filesystem::path(source).filename().string()}));
  if (body) found.answer.json["body"] = body_json(*body);
  if (found.result.status != CalibrationStatus::ok) return found.answer;
  found.answer.json["X_BC"] = six_of(found.result.X_WC);
  if (control) add_world(options, *control, found);
  return found.answer;
}

}  // namespace

void add_calibrate_body(cli::Verb calibrate, int& exit_status) {
  auto options = std::make_shared<Options>();
  // Maximum likelihood: the marks' places are as good as their covariances say.
  options->points.refine = "joint";
  const Verb verb = calibrate.add_subcommand(
      "body", "One camera from a calibration body, in the world by its control marks");
  const VerbOption image = verb.add_option("--image", options->body.image, "picture of the body");
  verb.add_option("--body", options->body.body, "CSV: mark x_mm y_mm z_mm [radius_mm nx ny nz]");
  verb.add_option("--points", options->points.points, "CSV of find-body instead of a picture")
      .excludes(image);
  verb.add_option("--control", options->control, "CSV: [mark] xa ya za xb yb zb, control marks in W and B");
  verb.add_option("--control-sigma-mm", options->control_sigma_mm,
                  "of one coordinate of a control mark (0.05)")
      .range(1e-6, 100.0);
  add_body_options(verb, options->body);
  add_problem_options(verb, options->points);
  add_answer_options(verb, options->points);
  verb.footer(calibrate_body_help);
  verb.callback([options, &exit_status] {
    exit_status = run([&] { return calibrate_body(*options); }, options->points.json);
  });
}

}  // namespace zeropose
