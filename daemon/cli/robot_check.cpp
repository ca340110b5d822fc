#include "daemon/cli/robot_check.h"

#include <chrono>
#include <fstream>
#include <memory>
#include <optional>

#include "config/text.h"
#include "daemon/cli/answer.h"
#include "daemon/cli/robot_choice.h"
#include "protocol/convention_check.h"
#include "protocol/line_socket.h"

namespace zeropose {
namespace {

using namespace cli;
using namespace std::chrono_literals;

// A hand places the object only so well; what was measured counts then.
constexpr double placed_within_mm = 15, placed_within_deg = 5, least_turn_deg = 10;

struct CheckOptions {
  std::string cell, robot, convention, robot_went, simulated, socket;
  double tolerance_mm = 3, tolerance_deg = 1.5;
  bool json = false;
};

constexpr const char* check_help =
    R"(Proves convention, axes and signs of one robot before production. The object is put at its zero and then in seven
known places (each turn at least 10 degrees, since a wrong order of angles hides at small ones). In each the
robot finds the same place on the object by itself (three-point method, or touching), and the pose that its controller
shows is typed in, in the controller's own numbers. A correction read back from the controller proves nothing: in a
wrong order the same numbers are read back.
--robot-went FILE: eight lines of numbers instead (zero first, then the shifts in order; # comments).
--simulated SOCKET: the simulated cell moves the object (zeropose-cell --control SOCKET), and back to its
zero at the end.
--socket SOCKET: the daemon measures each place, and what was measured counts; it shows the correction that the robot
would get. The job's limits must allow the turns.
Examples:
  zeropose robot test --cell cell.json --robot left --socket /run/zeropose/control.sock
  zeropose robot test --convention fanuc --robot-went shown.txt --json
Exit status: 0 proven, 1 not proven (with what would explain it), 2 wrong usage or unreadable input.)";

// One place of the object and what happened there.
struct Place {
  KnownShift shift;
  std::optional<Pose> X_WO;  // where the daemon measured it
  std::optional<Pose> measured_X_O0O;
  std::vector<double> went;
};

struct Robot {
  Convention convention = Convention::generic;
  std::optional<RobotOptions> options;  // where the cell file is known
};

Robot robot_of(const CheckOptions& options) {
  Robot robot;
  if (!options.cell.empty()) {
    robot.options = robot_of_cell(options.cell, options.robot);
    robot.convention = robot.options->convention;
  }
  if (!options.convention.empty()) {
    const auto named = convention_named(options.convention);
    if (!named || *named == Convention::matrix)
      throw std::invalid_argument("no robot's convention is called " + in_quotes(options.convention) +
                                  "; zeropose convert pose --help lists them");
    robot.convention = *named;
  } else if (options.cell.empty()) {
    throw std::invalid_argument("which robot? Give --cell and --robot, or --convention");
  }
  return robot;
}

// The operator's lines or the file's; nothing typed ends the check.
class WentReader {
 public:
  WentReader(const CheckOptions& options, std::size_t count) : count_(count) {
    if (options.robot_went.empty()) return;
    file_.open(options.robot_went);
    if (!file_) throw std::invalid_argument(options.robot_went + ": cannot be read");
    name_ = options.robot_went;
  }
  bool from_file() const { return file_.is_open(); }

  // Throws std::invalid_argument naming the line.
  std::vector<double> next(const std::string& place) {
    std::istream& in = from_file() ? static_cast<std::istream&>(file_) : std::cin;
    for (std::string line; std::getline(in, line);) {
      ++line_;
      line = line.substr(0, line.find('#'));
      for (char& c : line)
        if (c == ',' || c == ';') c = ' ';
      if (line.find_first_not_of(" \t\r") != std::string::npos) return numbers(line, place);
    }
    throw std::invalid_argument(concat({name_, ": ends before the pose for '", place, "'"}));
  }

 private:
  std::vector<double> numbers(const std::string& line, const std::string& place) const {
    std::istringstream text(line);
    std::vector<double> values;
    for (double value = 0; text >> value;) values.push_back(value);
    if (!text.eof() || values.size() != count_)
      throw std::invalid_argument(concat({name_, ":", std::to_string(line_), ": '", place, "' needs ",
                                          std::to_string(count_), " numbers, found: ", line}));
    return values;
  }

  std::size_t count_;
  std::ifstream file_;
  std::string name_ = "standard input";
  int line_ = 0;
};

// Puts the object back to its zero, whatever happens.
class SimulatedObject {
 public:
  explicit SimulatedObject(std::string socket) : socket_(std::move(socket)) {}
  ~SimulatedObject() {
    try {
      if (moved_) put(Pose::Identity());
    } catch (const std::exception& error) {
      std::cerr << error.what() << '\n';
    }
  }
  SimulatedObject(const SimulatedObject&) = delete;
  SimulatedObject& operator=(const SimulatedObject&) = delete;

  void put(const Pose& X_O0O) {
    if (socket_.empty()) return;
    moved_ = true;
    const Json answer =
        Json::parse(ask(socket_, Json{{"cmd", "shift"}, {"pose", six_of(X_O0O)}}.dump(), 30s));
    if (answer.value("status", "") != "ok")
      throw std::invalid_argument(
          concat({socket_, ": the object cannot be moved: ", answer.value("reason", "no reason")}));
  }

 private:
  std::string socket_;
  bool moved_ = false;
};

Pose pose_of(const Json& six) {
  return from_six_numbers({six.at(0), six.at(1), six.at(2), six.at(3), six.at(4), six.at(5)});
}

double turn_deg(const Pose& X) { return log_so3(X.linear()).norm() * degrees_per_radian; }

// Empty, or why the check cannot go on.
std::string measure(const std::string& socket, Place& place) {
  const Json answer = Json::parse(ask(socket, Json{{"cmd", "measure"}}.dump(), 30s));
  if (answer.value("status", "") != "ok" || !answer.contains("X_O0O"))
    return concat({"'", place.shift.name, "' could not be measured: ", answer.value("reason", "no reason")});
  place.measured_X_O0O = pose_of(answer["X_O0O"]);
  place.X_WO = pose_of(answer["X_WO"]);
  const Pose off = place.shift.X_O0O.inverse() * *place.measured_X_O0O;
  const bool was_turned = turn_deg(place.shift.X_O0O) > 0;
  if (off.translation().norm() > placed_within_mm || turn_deg(off) > placed_within_deg ||
      (was_turned && turn_deg(*place.measured_X_O0O) < least_turn_deg))
    return concat({"'", place.shift.name, "' was measured as", table_of(six_of(*place.measured_X_O0O), 2),
                   ": the object does not stand as asked"});
  return "";
}

// What the robot would get, where that is known.
std::string correction_text(const Robot& robot, const Place& place) {
  if (!robot.options) return "";
  const CorrectionFrame frame = robot.options->frame;
  std::optional<Pose> X;
  if (place.X_WO)
    X = correction(frame, robot.options->X_WR, *place.X_WO * place.measured_X_O0O->inverse(), *place.X_WO);
  else if (frame == CorrectionFrame::object_zero)
    X = place.shift.X_O0O;
  if (!X) return "";
  std::string text = "  the robot would get:";
  const std::vector<double> values = to_maker(robot.convention, *X);
  const auto names = field_names(robot.convention);
  for (std::size_t i = 0; i < values.size(); ++i) {
    std::ostringstream one;
    one << ' ' << names[i] << '=' << std::setprecision(8) << values[i];
    text += one.str();
  }
  return text + '\n';
}

std::string fields_text(Convention convention) {
  std::string text;
  for (const std::string_view name : field_names(convention))
    text.append(text.empty() ? "" : " ").append(name);
  return text;
}

// Talks to the operator; with --json on stderr, so that stdout has the one object only.
void tell(const CheckOptions& options, const std::string& text) {
  (options.json ? std::cerr : std::cout) << text << std::flush;
}

void let_it_be_moved(const CheckOptions& options, const Place& place, bool by_hand) {
  tell(
      options,
      concat({by_hand ? "Now bring the object here: " : "The object is now here: ", place.shift.name, "\n"}));
  if (!by_hand || options.socket.empty()) return;
  tell(options, "  Enter when it stands still: ");
  std::string line;
  std::getline(std::cin, line);
}

std::vector<Place> all_places() {
  std::vector<Place> places{{{"at its zero", Pose::Identity()}, {}, {}, {}}};
  for (const KnownShift& shift : known_shifts()) places.push_back({shift, {}, {}, {}});
  return places;
}

Json places_json(const std::vector<Place>& places, const ConventionVerdict& verdict) {
  Json list = Json::array();
  for (std::size_t i = 0; i < places.size(); ++i) {
    Json one{{"place", places[i].shift.name},
             {"pose", six_of(places[i].shift.X_O0O)},
             {"measured", places[i].measured_X_O0O ? Json(six_of(*places[i].measured_X_O0O)) : Json()},
             {"robot_went", places[i].went}};
    if (i > 0) {
      one["agrees"] = verdict.shifts[i - 1].agrees;
      one["off_mm"] = verdict.shifts[i - 1].off_mm;
      one["off_deg"] = verdict.shifts[i - 1].off_deg;
    }
    list.push_back(one);
  }
  return list;
}

Answer judge(const CheckOptions& options, const Robot& robot, const std::vector<Place>& places) {
  ConventionCheck check;
  check.convention = robot.convention;
  check.tolerance_mm = options.tolerance_mm;
  check.tolerance_deg = options.tolerance_deg;
  check.at_zero = places.front().went;
  const Pose X_ZO0 = places.front().measured_X_O0O.value_or(Pose::Identity()).inverse();
  for (std::size_t i = 1; i < places.size(); ++i) {
    const Place& place = places[i];
    const Pose X_O0O = place.measured_X_O0O ? X_ZO0 * *place.measured_X_O0O : place.shift.X_O0O;
    check.shifts.push_back({place.shift.name, X_O0O});
    check.went.push_back(place.went);
  }
  const ConventionVerdict verdict = check_convention(check);
  Answer answer;
  answer.exit_status = verdict.proven ? done : no_answer;
  answer.json = {{"status", verdict.proven ? "ok" : "failed"},
                 {"reason", verdict.proven ? "" : verdict.text},
                 {"convention", name_of(robot.convention)},
                 {"proven", verdict.proven},
                 {"places", places_json(places, verdict)},
                 {"explanations", verdict.explanations},
                 {"same_numbers", Json::array()},
                 {"verdict", verdict.text}};
  for (const Convention same : verdict.same) answer.json["same_numbers"].push_back(name_of(same));
  for (const ShiftVerdict& shift : verdict.shifts) answer.text += shift.text + '\n';
  answer.text += verdict.text + '\n';
  return answer;
}

Answer check(const CheckOptions& options) {
  const Robot robot = robot_of(options);
  WentReader reader(options, field_names(robot.convention).size());
  SimulatedObject object(options.simulated);
  const bool by_hand = options.simulated.empty() && !reader.from_file();
  std::vector<Place> places = all_places();
  for (Place& place : places) {
    object.put(place.shift.X_O0O);
    let_it_be_moved(options, place, by_hand);
    if (!options.socket.empty())
      if (const std::string problem = measure(options.socket, place); !problem.empty())
        return failure(problem);
    tell(options, correction_text(robot, place));
    if (!reader.from_file())
      tell(options, concat({"  Where is the robot on it? ", fields_text(robot.convention), ": "}));
    place.went = reader.next(place.shift.name);
  }
  tell(options, "\n");
  return judge(options, robot, places);
}

// A socket that does not answer is no wrong usage.
Answer check_or_say_why_not(const CheckOptions& options) {
  try {
    return check(options);
  } catch (const ConfigError&) {
    throw;
  } catch (const std::runtime_error& error) {
    return failure(error.what());
  }
}

}  // namespace

void add_robot_check(cli::Verb robot, int& exit_status) {
  auto options = std::make_shared<CheckOptions>();
  const Verb verb = robot.add_subcommand("test", "Guided check of a robot's convention, axes and signs");
  verb.add_option("--cell", options->cell, "the cell file that names the robot's convention");
  verb.add_option("--robot", options->robot, "its name in the cell (the only one where there is one)");
  verb.add_option("--convention", options->convention, "without a cell, or another one than in the cell");
  verb.add_option("--robot-went", options->robot_went, "file with the robot's poses instead of typing them");
  verb.add_option("--simulated", options->simulated,
                  "control socket of the simulated cell that moves the object");
  verb.add_option("--socket", options->socket, "control socket of the daemon that measures each place");
  verb.add_option("--tolerance-mm", options->tolerance_mm, "that a shift may be off (3)").range(0.01, 50.0);
  verb.add_option("--tolerance-deg", options->tolerance_deg, "that a turn may be off (1.5)").range(0.01, 5.0);
  verb.add_flag(
      "--json", options->json,
      "one JSON object on stdout: status, reason, convention, proven, places [{place, pose, measured, "
      "robot_went, agrees, off_mm, off_deg}], explanations, same_numbers, verdict");
  verb.footer(check_help);
  verb.callback([options, &exit_status] {
    exit_status = run([&] { return check_or_say_why_not(*options); }, options->json);
  });
}

}  // namespace zeropose
