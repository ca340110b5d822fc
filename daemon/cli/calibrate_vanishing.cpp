#include <algorithm>
#include <memory>
#include <optional>
#include <sstream>

#include "calib/vanishing.h"
#include "config/svg.h"
#include "config/text.h"
#include "config/vanishing_tables.h"
#include "daemon/cli/answer.h"
#include "daemon/cli/calibrate.h"
#include "daemon/cli/calibrate_help.h"
#include "daemon/cli/camera_report.h"
#include "daemon/cli/convert.h"
#include "daemon/cli/output.h"

namespace zeropose {
namespace {

using namespace cli;

struct VanishingOptions {
  std::string pairs, corners, report;
  std::optional<std::string> origin, focal, near;
  std::optional<double> ratio, side_mm;
  std::size_t first = 0;
  double max_px = 0;
  int width_px = 0, height_px = 0;
  bool one_focal = false, square = false, json = false;
};

// Pairs with the images that they come from, and the images that give none.
struct PairSource {
  std::vector<RectangleImage> images;  // empty: the pairs were given
  std::vector<VanishingPair> pairs;
  std::vector<std::string> names;  // of the pairs
  Json skipped = Json::array();
  std::vector<std::string> from_diagonals;
};

void keep_first(auto& all, std::size_t first) {
  if (first > 0 && all.size() > first) all.resize(first);
}

PairSource source_of(const VanishingOptions& options) {
  PairSource source;
  if (options.pairs.empty() == options.corners.empty())
    throw std::invalid_argument("one of --pairs and --corners is required");
  if (!options.pairs.empty()) {
    source.pairs = load_vanishing_pairs(options.pairs);
    keep_first(source.pairs, options.first);
    for (std::size_t i = 0; i < source.pairs.size(); ++i) source.names.push_back(std::to_string(i + 1));
    return source;
  }
  if (!options.side_mm || (!options.ratio && !options.square))
    throw std::invalid_argument("--corners needs --side-mm and --ratio (or --square)");
  source.images = load_rectangle_images(options.corners);
  keep_first(source.images, options.first);
  for (const RectangleImage& image : source.images) {
    const RectanglePair found = vanishing_pair(image.corners_px, options.square, options.max_px);
    if (!found.pair) {
      source.skipped.push_back({{"image", image.name}, {"reason", found.reason}});
      continue;
    }
    source.pairs.push_back(*found.pair);
    source.names.push_back(image.name);
    if (found.from_diagonals) source.from_diagonals.push_back(image.name);
  }
  return source;
}

VanishingProblem problem_of(const VanishingOptions& options, const PairSource& source) {
  VanishingProblem problem;
  problem.pairs = source.pairs;
  if (options.origin) problem.origin_px = point_of_option(*options.origin, "--origin");
  if (options.focal) problem.focal_px = point_of_option(*options.focal, "--focal");
  if (options.near)
    problem.near_px = point_of_option(*options.near, "--near");
  else if (options.width_px > 0 && options.height_px > 0)
    problem.near_px = Eigen::Vector2d((options.width_px - 1) / 2.0, (options.height_px - 1) / 2.0);
  problem.one_focal = options.one_focal;
  problem.max_px = options.max_px;
  return problem;
}

Json poses_json(const VanishingOptions& options, const PairSource& source, const CameraModel& camera) {
  const RectangleSize size{options.ratio.value_or(1), *options.side_mm};
  Json poses = Json::array();
  for (const RectangleImage& image : source.images) {
    const RectanglePose pose = rectangle_pose(camera, image.corners_px, size);
    Json json = {{"image", image.name}};
    json["X_CO"] = pose.X_CO ? Json(six_of(*pose.X_CO)) : Json();
    json["reason"] = pose.reason;
    json["ratio_seen"] = pose.ratio_seen;
    json["rms_px"] = pose.rms_px;
    poses.push_back(json);
  }
  return poses;
}

std::string text_of(const Json& json) {
  std::ostringstream text;
  const auto line = [&](const char* name) {
    text << name << std::setw(13) << fixed_text(json[name].get<double>(), 3) << " px\n";
  };
  for (const char* name : {"fx", "fy", "cx", "cy"}) line(name);
  text << json["used"].get<std::size_t>() << " images used, condition of the equations "
       << json["condition"].get<double>() << "\n";
  for (const Json& skipped : json["skipped"])
    text << "warning: image " << skipped["image"].get<std::string>()
         << " skipped: " << skipped["reason"].get<std::string>() << "\n";
  if (!json.contains("poses")) return text.str();
  text << "X_CO, mm and degrees; side ratio as seen; RMS of the corners, px:\n";
  for (const Json& pose : json["poses"]) {
    if (pose["X_CO"].is_null())
      text << "  no pose: " << pose["reason"].get<std::string>();
    else
      text << table_of(pose["X_CO"].get<std::array<double, 6>>())
           << table_of(std::array{pose["ratio_seen"].get<double>(), pose["rms_px"].get<double>()});
    text << "  " << pose["image"].get<std::string>() << "\n";
  }
  return text.str();
}

// The images of the report, the skipped ones last.
std::vector<RectangleLine> lines_of(const Json& answer, const PairSource& source) {
  std::vector<RectangleLine> lines;
  const auto skipped = [&](const std::string& name) {
    return std::ranges::any_of(source.skipped, [&](const Json& one) { return one["image"] == name; });
  };
  if (answer.contains("poses")) {
    for (const Json& pose : answer["poses"])
      if (!skipped(pose["image"]))
        lines.push_back({pose["image"], pose["reason"], pose["ratio_seen"], pose["rms_px"]});
  } else {
    for (const std::string& name : source.names)
      if (!skipped(name)) lines.push_back({name, {}});
  }
  for (const Json& one : source.skipped) lines.push_back({one["image"], one["reason"]});
  return lines;
}

Answer calibrate_vanishing(const VanishingOptions& options) {
  PairSource source = source_of(options);
  const VanishingResult result = calibrate_by_vanishing_points(problem_of(options, source));
  for (const SkippedPair& skipped : result.skipped)
    source.skipped.push_back({{"image", source.names[skipped.index]}, {"reason", skipped.reason}});
  if (result.status != VanishingStatus::ok) {
    Answer answer = failure(result.reason);
    answer.json["used"] = result.used.size();
    answer.json["skipped"] = source.skipped;
    return answer;
  }
  Answer answer;
  answer.json = {{"status", "ok"},
                 {"reason", ""},
                 {"fx", result.fx_px},
                 {"fy", result.fy_px},
                 {"cx", result.cx_px},
                 {"cy", result.cy_px},
                 {"used", result.used.size()},
                 {"skipped", source.skipped},
                 {"condition", result.condition},
                 {"from_diagonals", source.from_diagonals}};
  if (!source.images.empty()) {
    const CameraModel camera{options.width_px, options.height_px, result.fx_px, result.fy_px,
                             result.cx_px,     result.cy_px,      Division{}};
    answer.json["poses"] = poses_json(options, source, camera);
  }
  answer.text = text_of(answer.json);
  if (!options.report.empty())
    write_page(options.report,
               vanishing_report(result, lines_of(answer.json, source),
                                concat({"Images: ", options.pairs, options.corners})),
               answer);
  return answer;
}

}  // namespace

void add_calibrate_vanishing(cli::Verb calibrate, int& exit_status) {
  auto options = std::make_shared<VanishingOptions>();
  const Verb verb =
      calibrate.add_subcommand("vanishing", "Internals from the vanishing points of a rectangle");
  verb.add_option("--pairs", options->pairs, "CSV: v1_u_px v1_v_px v2_u_px v2_v_px");
  verb.add_option("--corners", options->corners, "CSV: image corner u_px v_px, corner 1..4 = A B C D");
  verb.add_option("--ratio", options->ratio, "k = AD / AB").range(1e-3, 1e3);
  verb.add_option("--side-mm", options->side_mm, "L = AB").range(1e-3, 1e6);
  verb.add_flag("--square", options->square, "the rectangle is a square: its diagonals help");
  verb.add_option("--first", options->first, "only the first N images").range(1, 1000000);
  verb.add_option("--max-px", options->max_px, "skip vanishing points farther away than this (off)")
      .range(1.0, 1e12);
  verb.add_option("--origin", options->origin, "CX,CY is known");
  verb.add_option("--focal", options->focal, "FX,FY is known");
  verb.add_option("--near", options->near, "CX,CY about: where two origins fit (the image centre)");
  verb.add_option("--width", options->width_px, "of the image, px").range(1, 65535);
  verb.add_option("--height", options->height_px, "of the image, px").range(1, 65535);
  verb.add_option("--report", options->report, "the report as a page (SVG) to write");
  verb.add_flag("--one-focal", options->one_focal, "fx = fy");
  verb.add_flag("--json", options->json,
                "one JSON object on stdout: status, reason, fx fy cx cy, used, skipped, condition, poses");
  verb.footer(calibrate_vanishing_help);
  verb.callback([options, &exit_status] {
    exit_status = run(
        [&] {
          if (options->square && options->ratio && *options->ratio != 1)
            throw std::invalid_argument("--square with --ratio: a square's ratio is 1");
          return calibrate_vanishing(*options);
        },
        options->json);
  });
}

}  // namespace zeropose
