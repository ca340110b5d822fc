#include "sim/sim_file.h"

#include <algorithm>
#include <array>

#include "calib/robot_poses.h"
#include "config/body_tables.h"
#include "config/cameras.h"
#include "config/files.h"
#include "config/json_reader.h"
#include "sim/random.h"

namespace zeropose {
namespace {

PictureSettings read_picture(JsonObject& object) {
  PictureSettings picture;
  int seed = 1;
  object.read("surface_grey", picture.surface_grey, {1, 250});
  object.read("mark_grey", picture.mark_grey, {1, 250});
  object.read("illumination_gradient", picture.illumination_gradient, {0, 1});
  object.read("blur_sigma_px", picture.blur_sigma_px, {0.3, 5});
  object.read("noise_sigma_grey", picture.noise_sigma_grey,
              {0, 50, true});  // two like pictures are a frozen camera
  object.read("clutter", picture.clutter, 0, 100);
  object.read("seed", seed, 0, std::numeric_limits<int>::max());
  picture.seed = static_cast<std::uint64_t>(seed);
  return picture;
}

SheetObject read_sheet(JsonObject& object) {
  SheetObject sheet;
  std::vector<Eigen::Vector3d> outline;
  if (!object.read("outline_mm", outline, 1e5)) return sheet;
  const bool flat = std::ranges::all_of(outline, [](const auto& vertex) { return vertex.z() == 0; });
  if (outline.size() < 3 || !flat)
    object.add_mistake("outline_mm",
                       std::to_string(outline.size()) + (flat ? " corners" : " corners in space"),
                       "at least three [x, y, 0], in the order round the sheet");
  for (const Eigen::Vector3d& vertex : outline) sheet.outline_mm.emplace_back(vertex.head<2>());
  return sheet;
}

BallPlateObject read_ball_plate(JsonObject& object) {
  BallPlateObject plate;
  object.read("middle_mm", plate.middle_O_mm, 1e5);
  if (object.read("size_mm", std::span<double>(plate.size_mm.data(), 2), 1e5) &&
      !(plate.size_mm.minCoeff() > 0))
    object.add_mistake("size_mm", "a size that is not above 0", "[width, height]");
  return plate;
}

RoundedBox read_rounded_box(JsonObject& object) {
  RoundedBox box;
  const bool sized = object.read("half_mm", std::span<double>(box.half_mm.data(), 2), 1e5);
  object.read("corner_mm", box.corner_mm, {0, 1e5});
  if (sized && !(box.half_mm.minCoeff() > box.corner_mm))
    object.add_mistake("half_mm", "a box that is smaller than its round corners",
                       "half sizes above corner_mm");
  return box;
}

GapsObject read_gaps_object(JsonObject& object) {
  GapsObject gaps;
  object.read("opening", [&](JsonObject& box) { gaps.opening = read_rounded_box(box); });
  object.read("pane", [&](JsonObject& box) { gaps.pane = read_rounded_box(box); });
  object.read_optional("pane_grey", gaps.pane_grey, NumberRange{0, 255});
  object.read("hand_pose", gaps.X_RH);
  object.read("pane_in_hand", gaps.X_HT);
  return gaps;
}

WheelObject read_wheel_object(JsonObject& object) {
  WheelObject wheel;
  std::string type, known;
  double profile_radius_mm = 0;
  object.read("profile_radius_mm", profile_radius_mm, NumberRange{0, 1000, true});
  if (!object.read("tyre", type)) return wheel;
  for (const TyreShape& tyre : example_tyres()) {
    known += (known.empty() ? "" : ", ") + tyre.name;
    if (tyre.name == type) wheel.tyre = tyre;
  }
  if (wheel.tyre.name.empty())
    object.add_mistake("tyre", "\"" + type + "\"", "one of " + known);
  else
    wheel.profile_mm = TyreSurface(wheel.tyre).section(profile_radius_mm).z_mm;
  return wheel;
}

// The words, and who reads the rest.
ObjectTruth read_object_truth(JsonObject& object) {
  constexpr std::array<std::string_view, 5> kinds{"plates", "sheet", "ball_plate", "gaps", "wheel"};
  constexpr std::array<ObjectTruth (*)(JsonObject&), 5> readers{
      [](JsonObject&) -> ObjectTruth { return PlatesObject{}; },
      [](JsonObject& sheet) -> ObjectTruth { return read_sheet(sheet); },
      [](JsonObject& plate) -> ObjectTruth { return read_ball_plate(plate); },
      [](JsonObject& gaps) -> ObjectTruth { return read_gaps_object(gaps); },
      [](JsonObject& wheel) -> ObjectTruth { return read_wheel_object(wheel); }};
  std::size_t kind = 0;
  return object.read_word("kind", kinds, kind) ? readers[kind](object) : PlatesObject{};
}

void read_components(JsonObject& object, std::string_view key, Vector6& six) {
  if (object.read(key, std::span<double>(six.data(), 6), 1e5) && six.minCoeff() < 0)
    object.add_mistake(key, "a number below 0", "six numbers, none below 0");
}

RobotErrors read_errors(JsonObject& object) {
  RobotErrors errors;
  object.read("repeatability_mm", errors.repeatability_mm, NumberRange{0, 100});
  object.read("repeatability_deg", errors.repeatability_deg, NumberRange{0, 10});
  object.read("absolute_mm", errors.absolute_mm, NumberRange{0, 100});
  object.read("absolute_deg", errors.absolute_deg, NumberRange{0, 10});
  return errors;
}

BallInHand read_ball(JsonObject& object, SurveyDrive& survey) {
  BallInHand ball;
  Pose X_RH_first = Pose::Identity();
  Eigen::Vector3d step_mm = Eigen::Vector3d::Zero();
  bool along_hand = false;
  object.read("ball_in_hand_mm", ball.p_HT_mm, 1e4);
  object.read("radius_mm", ball.radius_mm, NumberRange{0, 1000, true});
  object.read("grey", ball.grey, NumberRange{0, 255});
  object.read("first_hand_pose", X_RH_first);
  object.read("step_mm", step_mm, 1e4);
  object.read_optional("along_hand", along_hand);
  survey.places = ball_grid(X_RH_first, step_mm, along_hand);
  return ball;
}

std::vector<PrintedMark> read_board(JsonObject& object) {
  int rows = 0, cols = 0;
  double pitch_mm = 0, diameter_mm = 0;
  object.read("rows", rows, 2, 100);
  object.read("cols", cols, 2, 100);
  object.read("pitch_mm", pitch_mm, NumberRange{0, 1000, true});
  object.read("diameter_mm", diameter_mm, NumberRange{0, 1000, true});
  return printed_board(rows, cols, pitch_mm, diameter_mm);
}

std::vector<PrintedMark> printed_marks(const std::filesystem::path& file) {
  std::vector<PrintedMark> marks;
  for (const BodyMark& mark : load_body(file)) {
    if (!(mark.radius_mm > 0) || mark.normal_B.isZero())
      throw ConfigError({file.string() + ", mark " + mark.name +
                         ": found no radius or no normal, expected radius_mm nx ny nz to draw it"});
    marks.push_back({mark.p_B_mm, mark.radius_mm, mark.normal_B.normalized()});
  }
  return marks;
}

// Where the hand goes with the cameras that it carries, or with what they look at.
void read_hand_poses(JsonObject& object, SurveyDrive& survey) {
  object.read_each("hand_poses", 3, [&](JsonObject& pose) {
    Pose X_RH = Pose::Identity();
    if (pose.read("X_RH", X_RH)) survey.places.push_back(X_RH);
  });
}

BallInWorld read_standing_ball(JsonObject& object) {
  BallInWorld ball;
  object.read("ball_in_world_mm", ball.p_W_mm, 1e5);
  object.read("radius_mm", ball.radius_mm, NumberRange{0, 1000, true});
  object.read("grey", ball.grey, NumberRange{0, 255});
  return ball;
}

ShownBody read_body(JsonObject& object, const std::filesystem::path& folder) {
  ShownBody body;
  std::string file;
  if (object.has("board") && object.has("body")) object.add_mistake("body", "a board as well", "one of both");
  object.read_optional("board", [&](JsonObject& board) { body.marks = read_board(board); });
  if (object.read_optional("body", file)) body.table = folder / file;
  Pose X_HB = Pose::Identity();
  if (object.read_optional("in_hand", X_HB))
    body.X_HB = X_HB;
  else
    object.read("in_world", body.X_WB);
  return body;
}

// Whoever jogs the robot turns the hand as he likes and moves it until the end touches the tip, about.
TouchedTip read_touches(JsonObject& object, SurveyDrive& survey) {
  TouchedTip tip;
  object.read("end_in_hand_mm", tip.p_HT_mm, 1e4);
  object.read("touched_mm", tip.p_R_mm, 1e5);
  object.read("miss_mm", tip.miss_mm, NumberRange{0, 100});
  std::vector<Eigen::Vector3d> turns_deg;
  object.read("turns_deg", turns_deg, 360);
  Random random(1);
  for (const Eigen::Vector3d& r_deg : turns_deg) {
    Pose X_RH = from_six_numbers({0, 0, 0, r_deg.x(), r_deg.y(), r_deg.z()});
    const Eigen::Vector3d miss_mm(random.normal(), random.normal(), random.normal());
    X_RH.translation() = tip.p_R_mm + tip.miss_mm * miss_mm - X_RH.linear() * tip.p_HT_mm;
    survey.places.push_back(X_RH);
  }
  if (turns_deg.size() < 3)
    object.add_mistake("turns_deg", std::to_string(turns_deg.size()) + " turns",
                       "[rx, ry, rz] of the hand at each touch, three and more");
  return tip;
}

SurveyDrive read_survey(JsonObject& object, const std::filesystem::path& folder) {
  SurveyDrive survey;
  const bool touches = object.has("touched_mm");
  if (!touches) object.read("camera", survey.camera);
  survey.name = survey.camera;
  if (touches)
    object.read("name", survey.name);
  else
    object.read_optional("name", survey.name);
  StandingObject standing;
  if (touches)
    survey.target = read_touches(object, survey);
  else if (object.has("board") || object.has("body"))
    survey.target = read_body(object, folder);
  else if (object.has("ball_in_world_mm"))
    survey.target = read_standing_ball(object);
  else if (object.read_optional("object_of", standing.job))
    survey.target = standing;
  else
    survey.target = read_ball(object, survey);
  if (!touches && !std::holds_alternative<BallInHand>(survey.target)) read_hand_poses(object, survey);
  object.read_optional("robot", [&](JsonObject& robot) { survey.errors = read_errors(robot); });
  return survey;
}

DriveOptions read_drive(JsonObject& object) {
  DriveOptions drive;
  object.read_each_optional("poses", [&](JsonObject& pose) {
    Pose X_O0O = Pose::Identity();
    if (pose.read("X_O0O", X_O0O)) drive.poses.push_back(X_O0O);
  });
  if (drive.poses.empty()) read_components(object, "shift", drive.shift);
  object.read_optional("beyond_every", drive.beyond_every, 0, 1000);
  read_components(object, "max_error", drive.max_error);
  object.read_optional("max_error_at_points_mm", drive.max_error_at_points_mm, NumberRange{0, 1e5});
  object.read_optional("max_mounted_mm", drive.max_mounted_mm, NumberRange{0, 1e5});
  object.read_optional("robot", [&](JsonObject& robot) { drive.robot = read_errors(robot); });
  object.read_optional("robot_max_mm", drive.robot_max_mm, NumberRange{0, 1e5, true});
  object.read_optional("robot_max_deg", drive.robot_max_deg, NumberRange{0, 180, true});
  return drive;
}

GapDriveOptions read_gap_drive(JsonObject& object) {
  GapDriveOptions drive;
  read_components(object, "shift", drive.shift);
  object.read("robot", [&](JsonObject& robot) { drive.robot = read_errors(robot); });
  object.read("gain_error", drive.gain_error, NumberRange{0, 1});
  object.read("even_within_mm", drive.even_within_mm, NumberRange{0, 100, true});
  object.read_optional("most_motions", drive.most_motions, 1, 1000);
  object.read_optional("spoilt_every", drive.spoilt_every, 0, 1000);
  object.read_optional("robot_max_mm", drive.robot_max_mm, NumberRange{0, 1e5, true});
  object.read_optional("robot_max_deg", drive.robot_max_deg, NumberRange{0, 180, true});
  return drive;
}

}  // namespace

void load_marks(SurveyDrive& survey) {
  auto* body = std::get_if<ShownBody>(&survey.target);
  if (body != nullptr && !body->table.empty()) body->marks = printed_marks(body->table);
}

SimFile load_sim_file(const std::filesystem::path& path) {
  const JsonValue tree = parse_json(read_file(path), path.string());
  JsonReading reading(path.string());
  SimFile file;
  read_object(tree, "", reading, [&](JsonObject& top) {
    top.read("cameras", [&](JsonObject& cameras) { file.cameras = read_cameras(cameras); });
    top.read_optional("object", [&](JsonObject& object) { file.object = read_object_truth(object); });
    top.read_optional("drive", [&](JsonObject& drive) { file.drive = read_drive(drive); });
    top.read_optional("gap_drive", [&](JsonObject& drive) { file.gap_drive = read_gap_drive(drive); });
    top.read_each_optional("surveys", [&](JsonObject& survey) {
      file.surveys.push_back(read_survey(survey, path.parent_path()));
    });
    top.read("picture", [&](JsonObject& picture) { file.picture = read_picture(picture); });
  });
  reading.throw_if_wrong();
  return file;
}

std::string calibration_text(std::span<const CalibratedCamera> cameras, std::string_view comment) {
  return "// " + std::string(comment) + "\n" + cameras_text({cameras.begin(), cameras.end()});
}

}  // namespace zeropose
