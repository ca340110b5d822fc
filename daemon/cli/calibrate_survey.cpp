#include <chrono>
#include <csignal>
#include <iomanip>
#include <iostream>
#include <memory>
#include <sstream>
#include <thread>

#include "calib/robot_poses.h"
#include "config/atomic_file.h"
#include "config/body_tables.h"
#include "config/config_error.h"
#include "config/robot_tables.h"
#include "config/text.h"
#include "daemon/cli/answer.h"
#include "daemon/cli/calibrate.h"
#include "daemon/cli/convert.h"
#include "daemon/cli/output.h"
#include "daemon/control.h"
#include "protocol/line_socket.h"

namespace zeropose {
namespace {

using namespace cli;
using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;

constexpr const char* help =
    R"(Gathers, with the running daemon, what the calibrations with a robot are made from. While it waits, the robot's
program goes through its positions and tells each by AtPosition (index from 1, pose of the hand; docs/modbus.md). At
each one the camera takes two pictures and looks for the target; the robot is answered "done", or why the position
does not count (the target is out of sight, hidden, twice there, or still moving), and may tell it again. No position
is lost: what was gathered when the time is up, or at Ctrl-C, is written too.
  --target ball      one ball anywhere in the picture: ball grids. Then: zeropose calibrate ball
  --target disc      one flat disc: the marks of a new object, one at each position. Then: zeropose teach
  --target circles, asymmetric-circles, chessboard
                     a board of --rows --cols --pitch-mm: hand-eye. Then: zeropose calibrate hand-eye. It must look
                     different from every side: asymmetric circles with an odd number of rows. --diameter-mm of its
                     circles lets the calibrations correct that the centre of an image is not the image of a centre
  --target body      a calibration body, --body table.csv (zeropose find-body --help): hand-eye without a laser tracker,
                     and from one position with control marks its points for calibrate points
  --target touch     a tool's end that touches one fixed tip from several orientations, without --camera and --points:
                     --robot alone is written. Then: zeropose calibrate tool
Writes --robot (view, x_mm .. rz_deg: X_RH; of touches touch instead of view) and --points (view, u_px, v_px, covariance; of boards and bodies also x_mm
y_mm z_mm, and with a radius radius_mm nx ny nz). With both cameras of a stereo sensor, --camera left,right, each
position needs the target in both; --points then has the camera, and of balls and discs the name of the point: "ball",
or "mark" and the position, or what --marks says (one name per position; the same name again is the same mark).
The robot's own program knows the positions; or, with --drive ROBOT, the daemon tells it where to go, one position
after the other (target block, docs/modbus.md): --targets file.csv (view x_mm .. rz_deg: X_RH; counted from 1), or a grid of 3 x 3 x 3
from --first in steps of --step along the base's axes, or with --along-hand the hand's. The robot moves only inside its
own space, which its program checks; a position that is not taken comes again at the end.
Examples:
  zeropose calibrate survey --camera camera1 --drive robot1 --first -60,800,420,0,180,0 --step 60,60,80 --target ball \
      --min-diameter-px 20 --max-diameter-px 80 --robot robot.csv --points ball.csv
  zeropose calibrate survey --camera camera1 --positions 27 --target ball --min-diameter-px 20 --max-diameter-px 80 \
      --robot robot.csv --points ball.csv
Exit status: 0 all positions, 1 the time was up before (the files hold what there is), 2 no daemon or wrong usage.)";

struct Options {
  std::string socket = default_control_socket().string();
  std::string target = "ball", body, robot, points;
  std::vector<std::string> cameras, marks;
  std::string drive, targets;
  std::optional<std::string> first, step;
  bool along_hand = false;
  int positions = 0, rows = 0, cols = 0;
  double min_diameter_px = 0, max_diameter_px = 0, pitch_mm = 0, diameter_mm = 0, patience_s = 600;
  double radius_mm = 0;
  bool bright = false, replace = false, json = false;
};

bool is_round(const Options& options) { return options.target == "ball" || options.target == "disc"; }

Json ask_daemon(const Options& options, const Json& question) {
  Json answer = Json::parse(ask(options.socket, question.dump(), 30s));
  if (answer.value("status", "") != "ok") throw ConfigError({answer.value("reason", answer.dump())});
  return answer;
}

Json marks_of(const Options& options) {
  Json marks = Json::array();
  for (const BodyMark& mark : load_body(options.body))
    marks.push_back({{"name", mark.name},
                     {"p_B_mm", json_of(mark.p_B_mm)},
                     {"radius_mm", mark.radius_mm > 0 ? mark.radius_mm : options.radius_mm},
                     {"normal_B", json_of(mark.normal_B)}});
  return marks;
}

Json target_of(const Options& options) {
  if (is_round(options))
    return {{"kind", options.target},
            {"bright", options.bright},
            {"min_diameter_px", options.min_diameter_px},
            {"max_diameter_px", options.max_diameter_px}};
  if (options.target == "touch") return {{"kind", "touch"}};
  if (options.target == "body") return {{"kind", "body"}, {"marks", marks_of(options)}};
  return {{"kind", options.target},
          {"rows", options.rows},
          {"cols", options.cols},
          {"pitch_mm", options.pitch_mm},
          {"diameter_mm", options.diameter_mm}};
}

// What is new goes to stderr, so that whoever stands at the robot sees it.
void tell_progress(const Json& now, std::size_t& told, std::string& problem) {
  if (now["views"].size() != told) {
    told = now["views"].size();
    std::cerr << "position " << told << " of " << now["positions"] << '\n';
  }
  const std::string fresh = now["last_problem"].get<std::string>();
  if (fresh != problem && !fresh.empty()) std::cerr << "not taken: " << fresh << '\n';
  problem = fresh;
}

// What cannot succeed is refused before a robot starts.
void refuse_contradictions(const Options& options) {
  if (options.target == "touch") {
    if (!options.cameras.empty() || !options.points.empty())
      throw std::invalid_argument(
          "--target touch: expected neither --camera nor --points, nothing is looked at");
    return;
  }
  if (options.cameras.empty()) throw std::invalid_argument("--camera is required");
  if (options.points.empty()) throw std::invalid_argument("--points is required");
  if (options.robot == options.points)
    throw std::invalid_argument("--robot and --points: expected two files");
  if (options.cameras.size() > 1 && options.target == "body")
    throw std::invalid_argument("--target body: expected one camera");
  if (!options.marks.empty() && (options.target != "disc" || options.cameras.size() < 2))
    throw std::invalid_argument("--marks: expected --target disc and the two cameras of a stereo sensor");
  if (is_round(options)) {
    if (!(options.min_diameter_px > 0 && options.max_diameter_px > options.min_diameter_px))
      throw std::invalid_argument(
          concat({"--target ", options.target,
                  ": expected --min-diameter-px above 0 and a larger --max-diameter-px"}));
    return;
  }
  if (options.target == "body") {
    if (options.body.empty())
      throw std::invalid_argument("--target body: expected --body, the table of its marks");
    return;
  }
  if (options.rows < 2 || options.cols < 2 || !(options.pitch_mm > 0))
    throw std::invalid_argument(
        concat({"--target ", options.target, ": expected --rows, --cols (2 and more) and --pitch-mm"}));
  if (options.diameter_mm < 0 || options.diameter_mm >= 2 * options.pitch_mm ||
      (options.diameter_mm > 0 && options.target == "chessboard"))
    throw std::invalid_argument(
        "--diameter-mm: expected that of a board's circles, less than their distance");
  if (options.target == "circles")
    throw std::invalid_argument(
        "--target circles: the board looks the same from two sides or four, so that its frame turns from "
        "picture to "
        "picture; take asymmetric-circles with an odd number of rows");
  if (options.target == "asymmetric-circles" && options.rows % 2 == 0)
    throw std::invalid_argument(
        "--target asymmetric-circles: with an even number of rows the board looks the same from two sides; "
        "take one with "
        "an odd number");
}

// Where the robot is told to go; empty: its own program knows.
std::vector<Pose> targets_of(const Options& options) {
  const bool grid = options.first || options.step || options.along_hand;
  if (options.drive.empty()) {
    if (grid || !options.targets.empty())
      throw std::invalid_argument("--targets, --first, --step: expected --drive, the robot that goes there");
    if (options.positions == 0) throw std::invalid_argument("expected --positions, or --drive with targets");
    return {};
  }
  if (grid == !options.targets.empty() || (grid && !(options.first && options.step)))
    throw std::invalid_argument("--drive: expected --targets, or --first and --step");
  std::vector<Pose> targets;
  if (grid)
    targets = ball_grid(*pose_of_option(options.first, "--first"), place_of_option(*options.step, "--step"),
                        options.along_hand);
  else
    for (const HandPose& pose : load_hand_poses(options.targets, "view", false)) targets.push_back(pose.X_RH);
  if (options.positions != 0 && options.positions != static_cast<int>(targets.size()))
    throw std::invalid_argument(concat({"--positions: found ", std::to_string(options.positions),
                                        ", there are ", std::to_string(targets.size()), " targets"}));
  return targets;
}

// Set by Ctrl-C: a robot must not be told where to go any longer.
volatile std::sig_atomic_t interrupted = 0;

// Ends the survey whatever happens.
class RunningSurvey {
 public:
  RunningSurvey(const Options& options, const Json& question)
      : options_(options), number_(ask_daemon(options, question)["survey"]) {
    for (const int signal : {SIGINT, SIGTERM}) std::signal(signal, [](int) { interrupted = 1; });
  }
  ~RunningSurvey() {
    try {
      ask_daemon(options_, {{"cmd", "survey-end"}, {"survey", number_}});
    } catch (const std::exception& error) {
      std::cerr << error.what() << '\n';
    }
  }
  RunningSurvey(const RunningSurvey&) = delete;
  RunningSurvey& operator=(const RunningSurvey&) = delete;
  std::uint64_t number() const { return number_; }

 private:
  const Options& options_;
  const std::uint64_t number_;
};

Json gathered(const Options& options, std::uint64_t survey) {
  const auto deadline = Clock::now() + std::chrono::duration<double>(options.patience_s);
  std::size_t told = 0;
  std::string problem;
  for (;;) {
    const Json now = ask_daemon(options, {{"cmd", "survey"}});
    if (now["survey"] != survey || now["positions"] == 0)
      throw ConfigError({"the survey was ended, or another one took its place"});
    tell_progress(now, told, problem);
    if (now["missing"].empty() || Clock::now() >= deadline || interrupted) return now;
    std::this_thread::sleep_for(200ms);
  }
}

std::string robot_table(const Json& views, const std::string& name) {
  std::ostringstream text;
  text << name << ",x_mm,y_mm,z_mm,rx_deg,ry_deg,rz_deg\n" << std::setprecision(12);
  for (const Json& view : views) {
    text << view["position"];
    for (const Json& number : view["X_RH"]) text << ',' << number.get<double>();
    text << '\n';
  }
  return text.str();
}

bool has_radii(const Json& views) {
  for (const Json& view : views)
    for (const Json& point : view["points"])
      if (!(point["radius_mm"].get<double>() > 0)) return false;
  return true;
}

// Of what a stereo sensor saw: which round thing it is.
std::string point_name(const Options& options, std::size_t position) {
  if (options.target == "ball") return "ball";
  return options.marks.empty() ? concat({"mark", std::to_string(position)}) : options.marks.at(position - 1);
}

std::string points_table(const Json& views, const Options& options) {
  const bool round = is_round(options), stereo = options.cameras.size() > 1;
  std::vector<std::string> columns{"u_px", "v_px", "suu", "svv", "suv"};
  if (!round) columns.insert(columns.begin(), {"x_mm", "y_mm", "z_mm"});
  if (!round && has_radii(views)) columns.insert(columns.end(), {"radius_mm", "nx", "ny", "nz"});
  std::ostringstream text;
  text << "view" << (stereo ? ",camera" : "") << (stereo && round ? ",point" : "") << std::setprecision(10);
  for (const std::string& column : columns) text << ',' << column;
  text << '\n';
  for (const Json& view : views)
    for (const Json& point : view["points"]) {
      text << view["position"];
      if (stereo) text << ',' << point["camera"].get<std::string>();
      if (stereo && round) text << ',' << point_name(options, view["position"].get<std::size_t>());
      for (const std::string& column : columns) text << ',' << point[column].get<double>();
      text << '\n';
    }
  return text.str();
}

Answer survey(const Options& options) {
  refuse_contradictions(options);
  const bool touches = options.target == "touch";
  for (const std::string& path : {options.robot, options.points})
    if (!path.empty()) refuse_existing(path, options.replace);
  const std::vector<Pose> targets = targets_of(options);
  const std::size_t positions =
      targets.empty() ? static_cast<std::size_t>(options.positions) : targets.size();
  if (!options.marks.empty() && options.marks.size() != positions)
    throw std::invalid_argument(
        concat({"--marks: found ", std::to_string(options.marks.size()), " names, expected one for each of ",
                std::to_string(positions), " positions"}));
  Json question{{"cmd", "survey-start"},
                {"cameras", options.cameras},
                {"positions", positions},
                {"target", target_of(options)}};
  if (!targets.empty()) question["robot"] = options.drive;
  for (const Pose& X_RH : targets) question["targets"].push_back(six_of(X_RH));
  const RunningSurvey running(options, question);
  std::cerr << (targets.empty() ? "waiting for the robot to tell " : "the robot is told to go to ")
            << positions << " positions\n";
  const Json all = gathered(options, running.number());
  replace_file(options.robot, robot_table(all["views"], touches ? "touch" : "view"));
  if (!touches) replace_file(options.points, points_table(all["views"], options));
  std::string missing;
  for (const Json& position : all["missing"])
    missing += concat({missing.empty() ? "" : ", ", position.dump()});
  Answer answer;
  answer.json = {{"status", missing.empty() ? "ok" : "failed"},
                 {"reason", missing.empty() ? ""
                                            : concat({interrupted ? "stopped" : "the time was up",
                                                      " before the robot told position ", missing})},
                 {"positions", all["positions"]},
                 {"missing", all["missing"]},
                 {"last_problem", all["last_problem"]},
                 {"robot", options.robot},
                 {"points", options.points}};
  answer.exit_status = missing.empty() ? done : no_answer;
  answer.text = concat({std::to_string(all["views"].size()), " positions are in ", options.robot,
                        touches ? "" : " and ", options.points,
                        missing.empty() ? "" : "; missing are " + missing, "\n"});
  return answer;
}

}  // namespace

void add_calibrate_survey(cli::Verb calibrate, int& exit_status) {
  auto options = std::make_shared<Options>();
  const Verb verb =
      calibrate.add_subcommand("survey", "Gathers what a camera sees at positions that a robot tells");
  verb.add_option("--socket", options->socket, "the daemon's Unix socket").shows_default();
  verb.add_option("--camera", options->cameras,
                  "name of the camera in the cell; of a stereo sensor left,right")
      .delimiter(',');
  verb.add_option("--marks", options->marks, "names of the discs that a stereo sensor sees, one per position")
      .delimiter(',');
  verb.add_option("--positions", options->positions,
                  "how many positions the robot's own program goes through")
      .range(1, 1000);
  verb.add_option("--drive", options->drive, "name of the robot that is told where to go");
  verb.add_option("--targets", options->targets,
                  "CSV: view x_mm y_mm z_mm rx_deg ry_deg rz_deg (X_RH) to go to");
  verb.add_option("--first", options->first, "x,y,z,rx,ry,rz: the first X_RH of a grid of 3 x 3 x 3");
  verb.add_option("--step", options->step, "x,y,z: the grid's steps, mm");
  verb.add_flag("--along-hand", options->along_hand, "the steps run along the axes of the hand");
  verb.add_option("--target", options->target, "what is looked for")
      .shows_default()
      .one_of({"ball", "disc", "body", "touch", "circles", "asymmetric-circles", "chessboard"});
  verb.add_flag("--bright", options->bright, "the ball or disc is brighter than what surrounds it");
  verb.add_option("--min-diameter-px", options->min_diameter_px, "of the image of the ball or disc");
  verb.add_option("--max-diameter-px", options->max_diameter_px, "of the image of the ball or disc");
  verb.add_option("--rows", options->rows, "of a board");
  verb.add_option("--cols", options->cols, "of a board");
  verb.add_option("--pitch-mm", options->pitch_mm, "of a board");
  verb.add_option("--diameter-mm", options->diameter_mm, "of a board's circles");
  verb.add_option("--body", options->body, "CSV of a body: mark x_mm y_mm z_mm [radius_mm nx ny nz]");
  verb.add_option("--radius-mm", options->radius_mm, "of the body's marks where the table does not say");
  verb.add_option("--robot", options->robot, "the CSV of the hand's poses to write").required();
  verb.add_option("--points", options->points, "the CSV of the pixels to write");
  verb.add_flag("--replace", options->replace, "overwrite these two");
  verb.add_option("--patience", options->patience_s, "seconds to wait for all positions").shows_default();
  verb.add_flag("--json", options->json,
                "one JSON object on stdout: status, reason, positions, missing, last_problem, robot, points");
  verb.footer(help);
  verb.callback(
      [options, &exit_status] { exit_status = run([&] { return survey(*options); }, options->json); });
}

}  // namespace zeropose
