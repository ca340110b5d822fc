#include "daemon/cli/convert.h"

#include <iostream>
#include <iterator>
#include <memory>
#include <sstream>
#include <string>
#include <vector>

#include "calib/lens_conversion.h"
#include "config/atomic_file.h"
#include "config/camera_exchange.h"
#include "config/camera_file.h"
#include "config/csv.h"
#include "config/files.h"
#include "config/text.h"
#include "daemon/cli/answer.h"
#include "daemon/cli/help.h"
#include "daemon/cli/output.h"
#include "protocol/conventions.h"

namespace zeropose {
namespace {

using namespace cli;

Convention convention_of(const std::string& name) {
  if (name == "zeropose") return Convention::generic;
  if (const auto convention = convention_named(name)) return *convention;
  std::string all = "zeropose";
  for (const Convention convention : all_conventions()) all += ", " + std::string(name_of(convention));
  throw std::invalid_argument(concat({"found the convention ", in_quotes(name), ", expected one of ", all}));
}

struct Conversion {
  std::string place;
  std::vector<double> from, to;
  std::optional<Pose> X_AB;  // nullopt: the numbers are no pose
};

Conversion convert(Convention from, Convention to, const std::string& text, const std::string& place) {
  Conversion conversion{place, parse_numbers(text, place), {}, {}};
  const std::size_t count = to_maker(from, Pose::Identity()).size();
  if (conversion.from.size() != count)
    throw std::invalid_argument(
        concat({place, ": found ", std::to_string(conversion.from.size()), " numbers, expected the ",
                std::to_string(count), " of ", name_of(from)}));
  conversion.X_AB = from_maker(from, conversion.from);
  if (conversion.X_AB) conversion.to = to_maker(to, *conversion.X_AB);
  return conversion;
}

// One pose per line; blank lines and lines that begin with # are left out.
std::vector<Conversion> convert_lines(Convention from, Convention to, std::istream& lines) {
  std::vector<Conversion> conversions;
  std::string line;
  for (int number = 1; std::getline(lines, line); ++number) {
    const std::size_t first = line.find_first_not_of(" \t\r");
    if (first == std::string::npos || line[first] == '#') continue;
    if (line.back() == '\r') line.pop_back();
    conversions.push_back(convert(from, to, line, "stdin:" + std::to_string(number)));
  }
  return conversions;
}

std::string exact_text(std::span<const double> numbers) {
  std::ostringstream text;
  for (std::size_t i = 0; i < numbers.size(); ++i)
    text << (i > 0 ? " " : "") << std::setprecision(12) << numbers[i];
  return text.str();
}

struct ConvertOptions {
  std::string from, to;
  std::vector<std::string> values;
  bool json = false;
};

Answer convert_pose(const ConvertOptions& options) {
  const Convention from = convention_of(options.from), to = convention_of(options.to);
  std::string given;
  for (const std::string& value : options.values) given += value + " ";
  const std::vector<Conversion> conversions = options.values.empty()
                                                  ? convert_lines(from, to, std::cin)
                                                  : std::vector{convert(from, to, given, "values")};
  Answer answer;
  answer.json = {{"status", "ok"},
                 {"reason", ""},
                 {"from", name_of(from)},
                 {"to", name_of(to)},
                 {"fields", field_names(to)}};
  Json poses = Json::array();
  for (const Conversion& conversion : conversions) {
    if (!conversion.X_AB)
      return failure(conversion.place +
                     ": the numbers are no rotation (a quaternion must have length 1, a matrix must be "
                     "orthonormal with a last row 0 0 0 1)");
    poses.push_back({{"values", conversion.to}, {"X_AB", six_of(*conversion.X_AB)}});
    answer.text += exact_text(conversion.to) + "\n";
  }
  if (options.values.empty())
    answer.json["poses"] = poses;
  else
    answer.json.update(poses.front());
  return answer;
}

void add_pose(cli::Verb convert_verb, int& exit_status) {
  auto options = std::make_shared<ConvertOptions>();
  const Verb verb =
      convert_verb.add_subcommand("pose", "Converts a pose from one maker's numbers to another's");
  verb.add_option("--from", options->from, "the convention of the values").required();
  verb.add_option("--to", options->to, "the convention wanted").required();
  verb.add_option("VALUES", options->values, "6 numbers (abb: 7, matrix: 16), parted by blanks or commas");
  verb.add_flag("--json", options->json, "one JSON object on stdout: status, reason, values, fields, X_AB");
  verb.footer(convert_pose_help);
  verb.callback(
      [options, &exit_status] { exit_status = run([&] { return convert_pose(*options); }, options->json); });
}

// --- convert camera

struct CameraOptions {
  std::string from, to, name, file, output, model;
  int width_px = 0, height_px = 0;
  double max_residual_px = 0.05;
  bool replace = false, json = false;
};

CameraFile read_camera_as(const CameraOptions& options, CameraFormat format) {
  const std::string file = options.file.empty() ? "stdin" : options.file;
  std::string text;
  if (options.file.empty())
    text.assign(std::istreambuf_iterator<char>(std::cin), {});
  else
    text = read_file(options.file);
  if (format == CameraFormat::zeropose) return parse_camera(text, file, options.name);
  return {parse_yaml_camera(text, file, {options.width_px, options.height_px}), false};
}

std::string camera_text_as(const CameraFile& file, CameraFormat format) {
  const CalibratedCamera& camera = file.camera;
  if (format == CameraFormat::opencv) return opencv_camera_text(camera.model);
  if (format == CameraFormat::ros)
    return ros_camera_text(camera.model, camera.name.empty() ? "camera" : camera.name);
  return camera_file_text(file);
}

struct LensChange {
  std::string refusal;  // empty: done
  double worst_px = 0;
};

// The lens model that the format or the user wants.
LensChange change_lens(const CameraOptions& options, CameraFormat to, CameraModel& model) {
  const bool is_brown = std::holds_alternative<BrownConrady>(model.distortion);
  const bool want_brown =
      options.model.empty() ? is_brown || to != CameraFormat::zeropose : options.model == "brown";
  if (is_brown == want_brown) return {};
  const LensConversion conversion = want_brown ? to_brown(model) : to_division(model);
  if (!conversion.model)
    return {"the lens model has no image in some part of the chip: it cannot be converted"};
  if (conversion.worst_px > options.max_residual_px)
    return {concat({"the other lens model would be wrong by up to ", exact_text({&conversion.worst_px, 1}),
                    " px, more than --max-residual-px ", exact_text({&options.max_residual_px, 1}),
                    ": calibrate with --model ", want_brown ? "brown" : "division", " instead"})};
  model = *conversion.model;
  return {{}, conversion.worst_px};
}

Answer convert_camera(const CameraOptions& options) {
  const CameraFormat from = *camera_format_named(options.from), to = *camera_format_named(options.to);
  if (to != CameraFormat::zeropose && options.model == "division")
    throw std::invalid_argument("--model division: opencv and ros files know the brown model only");
  if (!options.output.empty()) refuse_existing(options.output, options.replace);
  CameraFile read = read_camera_as(options, from);
  CalibratedCamera& camera = read.camera;
  if (from != CameraFormat::zeropose || to == CameraFormat::ros)
    if (!options.name.empty()) camera.name = options.name;
  const LensChange change = change_lens(options, to, camera.model);
  if (!change.refusal.empty()) return failure(change.refusal);
  Json warnings = Json::array();
  if (change.worst_px > 0)
    warnings.push_back(concat({"the lens model was replaced by the other one: wrong by up to ",
                               exact_text({&change.worst_px, 1}), " px"}));
  if (to != CameraFormat::zeropose && read.has_pose)
    warnings.push_back("the pose X_WC has no place in this format and is left out");
  const std::string text = camera_text_as(read, to);
  for (const Json& warning : warnings) std::cerr << warning.get<std::string>() << '\n';
  if (!options.output.empty()) replace_file(options.output, text);
  Answer answer;
  answer.text = options.output.empty() ? text : "";
  answer.json = {{"status", "ok"},
                 {"reason", ""},
                 {"from", options.from},
                 {"to", options.to},
                 {"name", camera.name},
                 {"camera", Json::parse(camera_text(camera, read.has_pose))},
                 {"worst_px", change.worst_px},
                 {"warnings", warnings},
                 {"text", text}};
  return answer;
}

void add_camera(cli::Verb convert_verb, int& exit_status) {
  auto options = std::make_shared<CameraOptions>();
  const Verb verb = convert_verb.add_subcommand("camera", "Converts a camera file: OpenCV, ROS, zeropose");
  const std::vector<std::string> formats = {"opencv", "ros", "zeropose"};
  verb.add_option("--from", options->from, "what the file is").required().one_of(formats);
  verb.add_option("--to", options->to, "what is wanted").required().one_of(formats);
  verb.add_option("FILE", options->file, "the camera file; without it stdin");
  verb.add_option("--name", options->name, "which camera of a zeropose file; what to call it otherwise");
  verb.add_option("--output", options->output, "the file to write; without it stdout");
  verb.add_flag("--replace", options->replace, "overwrite --output; the old file is kept as .previous");
  verb.add_option("--model", options->model,
                  "the lens model wanted; without it as it is, or brown where only "
                  "that exists")
      .one_of({"division", "brown"});
  verb.add_option("--max-residual-px", options->max_residual_px,
                  "refuse a lens model that is wrong by more than this somewhere in the image (0.05)")
      .range(0.0, 100.0);
  verb.add_option("--width", options->width_px, "image width, for files that do not state it")
      .range(1, 65535);
  verb.add_option("--height", options->height_px, "image height, for files that do not state it")
      .range(1, 65535);
  verb.add_flag("--json", options->json,
                "one JSON object on stdout: status, reason, camera, worst_px, warnings, text");
  verb.footer(convert_camera_help);
  verb.callback([options, &exit_status] {
    exit_status = run([&] { return convert_camera(*options); }, options->json);
  });
}

}  // namespace

std::optional<Pose> cli::pose_of_option(const std::optional<std::string>& text, const std::string& option) {
  if (!text) return std::nullopt;
  return convert(Convention::generic, Convention::generic, *text, option).X_AB;
}

Eigen::Vector3d cli::place_of_option(const std::string& text, const std::string& option) {
  const std::vector<double> numbers = parse_numbers(text, option);
  if (numbers.size() != 3)
    throw std::invalid_argument(
        concat({option, ": found ", std::to_string(numbers.size()), " numbers, expected X,Y,Z in mm"}));
  return {numbers[0], numbers[1], numbers[2]};
}

Eigen::Vector2d cli::point_of_option(const std::string& text, const std::string& option) {
  const std::vector<double> numbers = parse_numbers(text, option);
  if (numbers.size() != 2)
    throw std::invalid_argument(concat(
        {option, ": found ", std::to_string(numbers.size()), " numbers, expected 2, parted by a comma"}));
  return {numbers[0], numbers[1]};
}

void add_convert(cli::Verb app, int& exit_status) {
  const Verb verb = app.add_subcommand(
      "convert", "Converts poses between robot makers' conventions, cameras between file formats");
  verb.require_subcommand();
  add_pose(verb, exit_status);
  add_camera(verb, exit_status);
}

}  // namespace zeropose
