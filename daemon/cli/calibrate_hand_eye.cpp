#include <cmath>
#include <memory>
#include <optional>
#include <sstream>

#include "calib/hand_eye.h"
#include "config/atomic_file.h"
#include "config/camera_file.h"
#include "config/robot_tables.h"
#include "config/text.h"
#include "daemon/cli/answer.h"
#include "daemon/cli/calibrate.h"
#include "daemon/cli/convert.h"
#include "daemon/cli/output.h"
#include "daemon/cli/robot_answer.h"
#include "daemon/cli/robot_report.h"

namespace zeropose {
namespace {

using namespace cli;

constexpr const char* calibrate_hand_eye_help =
    R"(The robot moves to several poses; at each a camera sees a board or a calibration body.
  eye-in-hand  the camera is on the hand, the board stands still: X_HC, and X_RB of the board
  eye-to-hand  the camera stands still, the board or body is on the hand: X_RC, and X_HB of the board. This is also the
               way to a camera's pose by a calibration body on the hand, without an external measuring system
robot.csv: view x_mm y_mm z_mm rx_deg ry_deg rz_deg, the hand's pose X_RH (flange, no tool set), R = Rz(rz) Ry(ry) Rx(rx).
points.csv: view x_mm y_mm [z_mm] u_px v_px in the board's frame, optional suu svv suv (covariance, px^2), radius_mm (round
flat marks, whose eccentricity is then corrected) and nx ny nz (their normal, else 0 0 1).
camera.json: the internals, which are held; its X_WC is not read.
At least 3 views with turns about two axes across each other; better 10 to 20, turned by 30 degrees and more about all
axes, the board filling half of the image. Stop the robot before each picture.
The noise of the robot's poses is estimated from how the views disagree, or given by --robot-sigma-mm and
--robot-sigma-deg. A view that contradicts the others is left out and named when it is clear which one; else the
candidates are named. views: where a view alone puts the board beside where robot and answer put it (error_mm, error_deg).
scale: by which the board's coordinates would fit better, a diagnosis of a wrong pitch; it is not applied.
--output writes the camera, ready for zeropose calibration activate.
Example:
  zeropose calibrate hand-eye --setup eye-to-hand --robot robot.csv --points points.csv --camera camera.json --json
Exit status: 0 done, 1 the views cannot give an answer (status and reason say why), 2 wrong usage or unreadable input.)";

struct HandEyeOptions {
  std::string setup, robot, points, camera, name, output, report, active;
  std::optional<std::string> X_WR;
  double sigma_px = 0, robot_sigma_mm = 0, robot_sigma_deg = 0;
  bool replace = false, json = false;
};

bool in_hand(const HandEyeOptions& options) { return options.setup == "eye-in-hand"; }

// No number where there is none.
Json finite_json(double value) { return std::isfinite(value) ? Json(value) : Json(); }

Json views_json(const std::vector<HandEyeView>& views, const HandEyeResult& result) {
  Json json = Json::array();
  for (std::size_t v = 0; v < result.views.size(); ++v) {
    const HandEyeViewResult& view = result.views[v];
    const bool found = view.points_used > 0;
    json.push_back({{"view", views[v].name},
                    {"used", view.used},
                    {"reason", view.reason},
                    {"error_mm", found ? finite_json(view.error_mm) : Json()},
                    {"error_deg", found ? finite_json(view.error_deg) : Json()},
                    {"rms_px", found ? finite_json(view.rms_px) : Json()},
                    {"points_used", view.points_used},
                    {"X_CB", found ? Json(six_of(view.X_CB)) : Json()}});
  }
  return json;
}

Json names_json(const std::vector<HandEyeView>& views, const std::vector<std::size_t>& which) {
  Json names = Json::array();
  for (const std::size_t view : which) names.push_back(views[view].name);
  return names;
}

Json hand_eye_json(const HandEyeOptions& options, const std::vector<HandEyeView>& views,
                   const HandEyeResult& result) {
  const bool good = result.status == HandEyeStatus::ok;
  const char *camera = in_hand(options) ? "X_HC" : "X_RC", *board = in_hand(options) ? "X_RB" : "X_HB";
  Json json = {{"status", good ? "ok" : "failed"}, {"reason", result.reason}};
  json["what"] = name_of(result.status);
  json[camera] = good ? Json(six_of(result.X_FC)) : Json();
  json[board] = good ? Json(six_of(result.X_GB)) : Json();
  const auto both = [&](auto of) {
    return good ? Json{{camera, of(result.covariance_FC)}, {board, of(result.covariance_GB)}} : Json();
  };
  json["sigma"] = both([](const Matrix6& covariance) { return json_of(sigma_of(covariance)); });
  json["covariance"] = both([](const Matrix6& covariance) { return rows_json(covariance); });
  json["rms_px"] = finite_json(result.rms_px);
  json["rms_mm"] = finite_json(result.rms_mm);
  json["rms_deg"] = finite_json(result.rms_deg);
  json["sigma_px"] = result.sigma_px;
  json["robot_sigma_mm"] = result.robot_sigma_mm;
  json["robot_sigma_deg"] = result.robot_sigma_deg;
  json["few_views_factor"] = result.few_views_factor;
  json["scale"] = result.scale;
  json["scale_sigma"] = result.scale_sigma;
  json["redundancy"] = result.redundancy;
  json["views"] = views_json(views, result);
  json["removed"] = names_json(views, result.removed);
  json["suspects"] = names_json(views, result.suspects);
  if (result.status == HandEyeStatus::rotation_missing) add_open_axes(result.turns, json);
  json["warnings"] = result.warnings;
  return json;
}

std::string views_text(const std::vector<HandEyeView>& views, const HandEyeResult& result) {
  std::ostringstream text;
  text << "views: error mm, degrees, rms px\n";
  for (std::size_t v = 0; v < result.views.size(); ++v) {
    const HandEyeViewResult& view = result.views[v];
    text << table_of({&view.error_mm, 1}) << table_of({&view.error_deg, 1}) << table_of({&view.rms_px, 1})
         << "  " << views[v].name << (view.used ? "" : "  left out: " + view.reason) << "\n";
  }
  return text.str();
}

std::string hand_eye_text(const HandEyeOptions& options, const std::vector<HandEyeView>& views,
                          const HandEyeResult& result) {
  if (result.status != HandEyeStatus::ok)
    return "no answer: " + result.reason + "\n" + warnings_text(result.warnings);
  const Vector6 camera = sigma_of(result.covariance_FC), board = sigma_of(result.covariance_GB);
  std::ostringstream text;
  text << (in_hand(options) ? "X_HC" : "X_RC") << ", the camera, mm and degrees, and sigma:\n"
       << table_of(six_of(result.X_FC)) << "\n"
       << table_of({camera.data(), 6}) << "\n"
       << (in_hand(options) ? "X_RB" : "X_HB") << ", the board, and sigma:\n"
       << table_of(six_of(result.X_GB)) << "\n"
       << table_of({board.data(), 6}) << "\nrms " << result.rms_px << " px, " << result.rms_mm << " mm, "
       << result.rms_deg << " degrees; noise of a pixel " << result.sigma_px << " px, of the robot "
       << result.robot_sigma_mm << " mm and " << result.robot_sigma_deg << " degrees\n"
       << "scale of the board " << result.scale << " +- " << result.scale_sigma << "\n"
       << views_text(views, result);
  return text.str() + warnings_text(result.warnings);
}

// A camera's place in the robot's base must not pass for that in the world.
void refuse_contradictions(const HandEyeOptions& options) {
  if (in_hand(options) && options.X_WR)
    throw std::invalid_argument("--X-WR: a camera on the hand has no pose of its own in the world");
  if (options.output.empty()) return;
  if (!in_hand(options) && !options.X_WR)
    throw std::invalid_argument(
        "--output with eye-to-hand: expected --X-WR, the robot's base in the world (0,0,0,0,0,0 where they "
        "are one)");
  refuse_existing(options.output, options.replace);
}

void write_camera(const HandEyeOptions& options, const CameraFile& internals, const HandEyeResult& result) {
  const std::optional<Pose> X_WR = pose_of_option(options.X_WR, "--X-WR");
  CameraFile camera = internals;
  camera.has_pose = true;
  camera.camera.on_hand = in_hand(options);
  camera.camera.X_WC = in_hand(options) ? result.X_FC : X_WR.value_or(Pose::Identity()) * result.X_FC;
  replace_file(options.output, camera_file_text(camera));
}

// X_HC or X_RC of the camera in use.
std::optional<Pose> active_of(const HandEyeOptions& options) {
  if (options.active.empty()) return std::nullopt;
  const CameraFile active = load_camera(options.active, options.name);
  if (!active.has_pose || active.camera.on_hand != in_hand(options))
    throw std::invalid_argument(concat({options.active, ": found no ", in_hand(options) ? "X_HC" : "X_WC",
                                        ", expected it: the pose of the camera in use"}));
  if (in_hand(options)) return active.camera.X_WC;
  const std::optional<Pose> X_WR = pose_of_option(options.X_WR, "--X-WR");
  if (!X_WR)
    throw std::invalid_argument(
        "--active with eye-to-hand: expected --X-WR, the robot's base in the world (0,0,0,0,0,0 where they "
        "are one)");
  return X_WR->inverse() * active.camera.X_WC;
}

std::string source_of(const HandEyeOptions& options) {
  return concat({"Robot: ", options.robot, ". Points: ", options.points, ". Camera: ", options.camera,
                 options.name.empty() ? "" : " ", options.name});
}

Answer calibrate_hand_eye_of(const HandEyeOptions& options) {
  const CameraFile camera = load_camera(options.camera, options.name);
  const std::vector<HandEyeView> views = load_hand_eye_views(options.robot, options.points);
  HandEyeProblem problem;
  problem.model = camera.camera.model;
  problem.setup = in_hand(options) ? HandEyeSetup::eye_in_hand : HandEyeSetup::eye_to_hand;
  problem.views = views;
  problem.sigma_px = options.sigma_px;
  problem.robot_sigma_mm = options.robot_sigma_mm;
  problem.robot_sigma_deg = options.robot_sigma_deg;
  refuse_contradictions(options);
  const std::optional<Pose> active = active_of(options);
  const HandEyeResult result = calibrate_hand_eye(problem);
  const bool good = result.status == HandEyeStatus::ok;
  if (good && !options.output.empty()) write_camera(options, camera, result);
  Answer answer{good ? done : no_answer, hand_eye_json(options, views, result),
                hand_eye_text(options, views, result)};
  if (good && !options.report.empty())
    write_page(options.report, hand_eye_report(problem, result, active, source_of(options)), answer);
  return answer;
}

void add_options(cli::Verb verb, HandEyeOptions& options) {
  verb.add_option("--setup", options.setup, "where the camera is: eye-in-hand or eye-to-hand")
      .required()
      .one_of({"eye-in-hand", "eye-to-hand"});
  verb.add_option("--robot", options.robot,
                  "CSV: view x_mm y_mm z_mm rx_deg ry_deg rz_deg, the hand's pose X_RH")
      .required();
  verb.add_option("--points", options.points,
                  "CSV: view x_mm y_mm [z_mm] u_px v_px [suu svv suv] [radius_mm nx ny nz]")
      .required();
  verb.add_option("--camera", options.camera, "JSON of the camera: its internals").required();
  verb.add_option("--name", options.name, "of the camera, where the file holds several");
  verb.add_option("--sigma-px", options.sigma_px,
                  "noise of one pixel coordinate; without it from the residuals in the views")
      .range(1e-6, 100.0);
  const VerbOption mm = verb.add_option("--robot-sigma-mm", options.robot_sigma_mm,
                                        "of one coordinate of the hand; without it from the views")
                            .range(1e-6, 100.0);
  const VerbOption deg =
      verb.add_option("--robot-sigma-deg", options.robot_sigma_deg, "of the hand's turn about one axis")
          .range(1e-6, 10.0);
  mm.needs(deg), deg.needs(mm);
  verb.add_option("--X-WR", options.X_WR,
                  "x,y,z,rx,ry,rz of the robot's base in the world, for --output with eye-to-hand");
  verb.add_option("--output", options.output, "camera JSON to write: with X_HC, or with X_WC = X_WR X_RC");
  verb.add_flag("--replace", options.replace, "overwrite --output");
  const VerbOption report =
      verb.add_option("--report", options.report, "the report as a page (SVG) to write");
  verb.add_option("--active", options.active,
                  "camera JSON in use, for the report to compare with; eye-to-hand with --X-WR")
      .needs(report);
  verb.add_flag(
      "--json", options.json,
      "one JSON object on stdout: status, reason, X_HC and X_RB or X_RC and X_HB, sigma, covariance (6x6, "
      "mm\n"
      "and rad), rms_px, rms_mm, rms_deg, robot_sigma_mm, robot_sigma_deg, scale, views, removed, suspects,\n"
      "warnings");
}

}  // namespace

void add_calibrate_hand_eye(cli::Verb calibrate, int& exit_status) {
  auto options = std::make_shared<HandEyeOptions>();
  const Verb verb = calibrate.add_subcommand(
      "hand-eye", "A camera on a robot's hand or before it, from views of a board at several poses");
  add_options(verb, *options);
  verb.footer(calibrate_hand_eye_help);
  verb.callback([options, &exit_status] {
    exit_status = run([&] { return calibrate_hand_eye_of(*options); }, options->json);
  });
}

}  // namespace zeropose
