#include "daemon/cli_convert.h"

#include <iostream>
#include <memory>
#include <sstream>
#include <string>
#include <vector>

#include "config/csv.h"
#include "config/text.h"
#include "daemon/cli_answer.h"
#include "daemon/cli_help.h"
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

void add_pose(CLI::App& convert_verb, int& exit_status) {
  auto options = std::make_shared<ConvertOptions>();
  CLI::App* verb =
      convert_verb.add_subcommand("pose", "Converts a pose from one maker's numbers to another's");
  verb->add_option("--from", options->from, "the convention of the values")->required();
  verb->add_option("--to", options->to, "the convention wanted")->required();
  verb->add_option("VALUES", options->values, "6 numbers (abb: 7, matrix: 16), parted by blanks or commas");
  verb->add_flag("--json", options->json, "one JSON object on stdout: status, reason, values, fields, X_AB");
  verb->footer(convert_pose_help);
  verb->callback(
      [options, &exit_status] { exit_status = run([&] { return convert_pose(*options); }, options->json); });
}

}  // namespace

std::optional<Pose> cli::pose_of_option(const std::optional<std::string>& text, const std::string& option) {
  if (!text) return std::nullopt;
  return convert(Convention::generic, Convention::generic, *text, option).X_AB;
}

void add_convert(CLI::App& app, int& exit_status) {
  CLI::App* verb = app.add_subcommand("convert", "Converts poses between the conventions of robot makers");
  verb->require_subcommand(1);
  add_pose(*verb, exit_status);
}

}  // namespace zeropose
