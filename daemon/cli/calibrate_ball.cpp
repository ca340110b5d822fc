#include <algorithm>
#include <memory>
#include <optional>

#include "calib/eccentricity.h"
#include "calib/robot_poses.h"
#include "calib/words.h"
#include "config/csv.h"
#include "config/robot_tables.h"
#include "config/text.h"
#include "daemon/cli/calibrate.h"
#include "daemon/cli/calibration_answer.h"
#include "daemon/cli/convert.h"
#include "daemon/cli/points_options.h"

namespace zeropose {
namespace {

using namespace cli;

constexpr const char* calibrate_ball_help =
    R"(A ball and a robot instead of a board:
  eye-to-hand  the camera stands still and sees a ball on the tool. --tool is the ball's centre in the hand's frame, the
               p_HT of calibrate tool. The hand moves to a grid of places: X_RC
  eye-in-hand  the camera is on the hand and sees a ball that stands still. --ball is its centre in the robot's base,
               touched before with the tool. The hand moves and turns so that the ball is all over the picture: X_HC
robot.csv: view x_mm y_mm z_mm rx_deg ry_deg rz_deg, the hand's pose X_RH (flange, no tool set), R = Rz(rz) Ry(ry) Rx(rx).
pixels.csv: view u_px v_px, the ball's image, optional suu svv suv (covariance, px^2). A view without a pixel is named.
27 places, 3 x 3 x 3, that fill the picture at three distances are enough for internals and pose; without depth
(one plane) hold the internals: --start camera.json --fix fx,fy,cx,cy,K.
--radius-mm: the centre of a ball's outline is not the image of its centre; with it the difference is taken off.
--X-WR x,y,z,rx,ry,rz: the robot's base in the world; camera, sigma and correlation are then of X_WC, else X_WC in the
camera's JSON is X_RC (the base is the world) or X_HC (a camera on the hand).
All other options and the answer are those of calibrate points.
Examples:
  zeropose calibrate ball --setup eye-to-hand --robot robot.csv --pixels pixels.csv --tool 0,0,152.3 \
      --width 768 --height 572 --sigma-px 0.1 --report page.svg
  zeropose calibrate ball --setup eye-in-hand --robot robot.csv --pixels pixels.csv --ball=812.4,-33.1,105.0 \
      --start camera.json --fix fx,fy,cx,cy,K --json
Exit status: 0 done, 1 the places cannot give an answer (status and reason say why), 2 wrong usage or
unreadable input.)";

struct BallOptions {
  PointsOptions points;
  std::string setup, robot, pixels;
  std::optional<std::string> tool, ball, X_WR;
  double radius_mm = 0;
};

// Where the ball was, and what was seen of it.
struct BallPlaces {
  bool in_hand = false;
  Eigen::Vector3d centre_mm = Eigen::Vector3d::Zero();  // in the hand, or in the base
  std::optional<Pose> X_WR;
  std::vector<Pose> X_RH;  // one per pixel
  std::vector<ViewPixel> pixels;
  std::vector<std::string> without_pixel;
};

void refuse_wrong_centre(const BallOptions& options, bool in_hand) {
  if (in_hand && (!options.ball || options.tool))
    throw std::invalid_argument("eye-in-hand: expected --ball (its centre in the base) and no --tool");
  if (!in_hand && (!options.tool || options.ball))
    throw std::invalid_argument("eye-to-hand: expected --tool (the ball's centre in the hand) and no --ball");
  if (in_hand && options.X_WR)
    throw std::invalid_argument("--X-WR: a camera on the hand has no pose of its own in the world");
  if (!in_hand && !options.X_WR && !options.points.output.empty())
    throw std::invalid_argument(
        "--output with eye-to-hand: expected --X-WR, the robot's base in the world (0,0,0,0,0,0 where they "
        "are one)");
}

BallPlaces places_of(const BallOptions& options) {
  BallPlaces places;
  places.in_hand = options.setup == "eye-in-hand";
  refuse_wrong_centre(options, places.in_hand);
  places.centre_mm =
      places.in_hand ? place_of_option(*options.ball, "--ball") : place_of_option(*options.tool, "--tool");
  places.X_WR = pose_of_option(options.X_WR, "--X-WR");
  const std::vector<HandPose> poses = load_hand_poses(options.robot, "view", true);
  places.pixels = load_view_pixels(options.pixels, poses);
  for (const ViewPixel& pixel : places.pixels)
    places.X_RH.push_back(std::ranges::find(poses, pixel.view, &HandPose::name)->X_RH);
  for (const HandPose& pose : poses)
    if (std::ranges::find(places.pixels, pose.name, &ViewPixel::view) == places.pixels.end())
      places.without_pixel.push_back(pose.name);
  return places;
}

std::vector<CalibrationPoint> pairs_of(const BallPlaces& places, std::span<const Pose> X_RH) {
  const Pose X_WR = places.X_WR.value_or(Pose::Identity());
  std::vector<CalibrationPoint> points(X_RH.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    points[i].p_W_mm =
        places.in_hand ? X_RH[i].inverse() * places.centre_mm : X_WR * (X_RH[i] * places.centre_mm);
    points[i].u_px = places.pixels[i].u_px;
    points[i].covariance_px2 = places.pixels[i].covariance_px2;
  }
  return points;
}

// With the outlines' centres taken for the balls' centres, then twice without what they differ by.
CalibrationResult calibrate_balls(double radius_mm, PointsInput& input) {
  const std::vector<CalibrationPoint> seen = input.points;
  CalibrationResult result = calibrate(input.problem);
  for (int round = 0; round < 2 && radius_mm > 0 && result.status == CalibrationStatus::ok; ++round) {
    const Pose X_CW = result.X_WC.inverse();
    for (std::size_t i = 0; i < seen.size(); ++i)
      input.points[i].u_px =
          seen[i].u_px - ball_centre_offset(result.model, X_CW * seen[i].p_W_mm, radius_mm);
    result = calibrate(input.problem);
  }
  return result;
}

// A camera that misses the points by more is none.
constexpr double plausible_px = 3;

// As what the robot's poses may have been written down instead; empty: nothing known.
std::string doubt_of(const BallOptions& options, const BallPlaces& places) {
  const Misfit misfit = [&](std::span<const Pose> X_RH) -> std::optional<double> {
    const auto input = input_of(options.points, pairs_of(places, X_RH));
    const CalibrationResult result = calibrate(input->problem);
    if (result.status != CalibrationStatus::ok) return std::nullopt;
    return result.rms_px;
  };
  const Reading reading = better_reading(places.X_RH, misfit, plausible_px);
  return reading == Reading::as_expected ? "" : "the robot's poses look like " + words_of(reading);
}

std::vector<std::string> warnings_of(const BallPlaces& places, const CalibrationResult& result) {
  std::vector<std::string> warnings = doubtful_units(places.X_RH);
  if (const double tool_mm = places.centre_mm.norm();
      !places.in_hand && tool_mm > 0 && (tool_mm < 1 || tool_mm > 5000))
    warnings.push_back(concat({"--tool: the ball is ", number(tool_mm, 4),
                               " mm from the flange: expected mm. In a grid the ",
                               "hand does not turn, and nothing else shows a wrong tool"}));
  std::string missing;
  for (const std::string& view : places.without_pixel) missing += (missing.empty() ? "" : ", ") + view;
  if (!missing.empty())
    warnings.push_back(concat({std::to_string(places.without_pixel.size()),
                               " views of the robot's table have no pixel: ", missing}));
  if (result.diagnosis.coplanar)
    warnings.push_back(
        "all places of the ball are in one plane, which tells focal length and distance badly apart; add "
        "places at two other distances");
  return warnings;
}

void add_robot_poses(const BallPlaces& places, const CalibrationResult& result, Answer& answer) {
  const Pose X_RC = places.X_WR.value_or(Pose::Identity()).inverse() * result.X_WC;
  answer.json[places.in_hand ? "X_HC" : "X_RC"] = six_of(X_RC);
  if (places.X_WR) answer.json["X_WC"] = six_of(result.X_WC);
  answer.text +=
      concat({places.in_hand ? "X_HC" : "X_RC", ", mm and degrees:\n", table_of(six_of(X_RC)), "\n"});
}

Answer no_camera(CalibrationResult result, const std::string& doubt) {
  if (result.status == CalibrationStatus::ok) {
    result.status = CalibrationStatus::wrong_problem;
    result.reason = "the camera misses the points by " + number(result.rms_px) + " px (root mean square)";
  }
  if (!doubt.empty()) result.reason += "; " + doubt;
  for (const std::string& warning : result.diagnosis.warnings) result.reason += "; " + warning;
  return calibration_failure(result);
}

Answer calibrate_ball(const BallOptions& options) {
  refuse_contradictions(options.points);
  const BallPlaces places = places_of(options);
  const auto input = input_of(options.points, pairs_of(places, places.X_RH));
  CalibrationResult result = calibrate_balls(options.radius_mm, *input);
  const bool good = result.status == CalibrationStatus::ok;
  std::string doubt;
  const bool poor = result.rms_px > plausible_px;
  if (!good || poor) doubt = doubt_of(options, places);
  for (std::string& warning : warnings_of(places, result))
    result.diagnosis.warnings.push_back(std::move(warning));
  if (!good || poor) return no_camera(std::move(result), doubt);
  PointsOptions points = options.points;
  points.on_hand = places.in_hand;
  points.pose = places.in_hand ? "X_HC" : places.X_WR ? "X_WC" : "X_RC";
  Answer answer = answer_of(points, *input, result, "A robot's ball: " + options.pixels);
  add_robot_poses(places, result, answer);
  return answer;
}

void add_options(cli::Verb verb, BallOptions& options) {
  verb.add_option("--setup", options.setup, "where the camera is: eye-in-hand or eye-to-hand")
      .required()
      .one_of({"eye-in-hand", "eye-to-hand"});
  verb.add_option("--robot", options.robot,
                  "CSV: view x_mm y_mm z_mm rx_deg ry_deg rz_deg, the hand's pose X_RH")
      .required();
  verb.add_option("--pixels", options.pixels, "CSV: view u_px v_px [suu svv suv]").required();
  verb.add_option("--tool", options.tool, "X,Y,Z of the ball's centre in the hand (eye-to-hand)");
  verb.add_option("--ball", options.ball, "X,Y,Z of the ball's centre in the robot's base (eye-in-hand)");
  verb.add_option("--radius-mm", options.radius_mm, "of the ball: its outline's centre is then corrected")
      .range(0.0, 1e4);
  verb.add_option("--X-WR", options.X_WR, "x,y,z,rx,ry,rz of the robot's base in the world");
  add_problem_options(verb, options.points);
  add_answer_options(verb, options.points);
}

}  // namespace

void add_calibrate_ball(cli::Verb calibrate, int& exit_status) {
  auto options = std::make_shared<BallOptions>();
  const Verb verb = calibrate.add_subcommand(
      "ball", "One camera from a ball that a robot moves, or that its hand goes round");
  add_options(verb, *options);
  verb.footer(calibrate_ball_help);
  verb.callback([options, &exit_status] {
    exit_status = run([&] { return calibrate_ball(*options); }, options->points.json);
  });
}

}  // namespace zeropose
