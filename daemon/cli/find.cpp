#include "daemon/cli/find.h"

#include <array>
#include <cmath>
#include <fstream>
#include <iomanip>
#include <memory>
#include <numbers>
#include <sstream>
#include <stdexcept>
#include <utility>

#include "config/text.h"
#include "daemon/cli/answer.h"
#include "daemon/cli/grey_image.h"
#include "daemon/cli/help.h"
#include "daemon/cli/verb.h"
#include "daemon/overlay.h"
#include "measure/marks.h"
#include "measure/pattern.h"

namespace zeropose {
namespace {

using namespace cli;

struct Options {
  std::string image, kind = "circle", pattern, overlay;
  std::vector<double> window, click, inner;
  double min_diameter = 8, max_diameter = 0, direction = 0, direction_tolerance = 180, opening = 90;
  MarkSearch search;
  bool dark = true, json = false;
};

constexpr std::array kinds{std::pair{"circle", MarkKind::disc},     std::pair{"disc", MarkKind::disc},
                           std::pair{"ring", MarkKind::ring},       std::pair{"ball", MarkKind::ball},
                           std::pair{"slot", MarkKind::slot},       std::pair{"cross", MarkKind::cross},
                           std::pair{"corner", MarkKind::corner},   std::pair{"edge", MarkKind::edge},
                           std::pair{"template", MarkKind::pattern}};

double rad(double degrees) { return degrees * std::numbers::pi / 180; }

MarkSearch search_of(const Options& options, const ImageView& image, const Pattern& pattern) {
  MarkSearch search = options.search;
  for (const auto& [name, kind] : kinds)
    if (options.kind == name) search.kind = kind;
  const Eigen::Vector2d whole(image.width_px - 1, image.height_px - 1);
  search.expected_px = search.half_window_px = 0.5 * whole;
  if (!options.window.empty()) {
    const Eigen::Vector2d corner(options.window[0], options.window[1]);
    search.half_window_px = 0.5 * Eigen::Vector2d(options.window[2] - 1, options.window[3] - 1);
    search.expected_px = corner + search.half_window_px;
  }
  search.min_diameter_px = options.min_diameter;
  const double widest = options.window.empty() ? whole.minCoeff() / 2 : 2 * search.half_window_px.norm();
  search.max_diameter_px =
      options.max_diameter > 0 ? options.max_diameter : std::max(options.min_diameter, widest);
  search.inner_shares = options.inner;
  search.direction_rad = rad(options.direction);
  search.direction_tolerance_rad = rad(options.direction_tolerance);
  search.opening_rad = rad(options.opening);
  if (search.kind == MarkKind::pattern) search.pattern = &pattern;
  return search;
}

void check(const Options& options) {
  const bool edge = options.kind == "edge", pattern = options.kind == "template";
  if ((edge || pattern) && options.window.empty())
    throw std::invalid_argument(concat({"--kind ", options.kind, ": needs --window X,Y,W,H, where to look"}));
  if (pattern && options.pattern.empty())
    throw std::invalid_argument("--kind template: needs --template FILE, what to look for");
  if (options.kind == "ring" && options.inner.empty())
    throw std::invalid_argument(
        "--kind ring: needs --inner R1[,R2...], the inner circles' radii by the outer one's, e.g. --inner "
        "0.6");
  if (options.max_diameter > 0 && options.max_diameter < options.min_diameter)
    throw std::invalid_argument("--max-diameter is below --min-diameter");
}

Pattern taught(const Options& options) {
  if (options.kind != "template") return {};
  const StoredPicture image = load_deep_image(options.pattern);
  const Eigen::Vector2d middle(0.5 * (image.width_px - 1), 0.5 * (image.height_px - 1));
  const Eigen::Vector2d clicked = options.click.empty() ? middle : Eigen::Vector2d(options.click.data());
  Pattern pattern = teach_pattern(view_of(image), {0, 0, image.width_px - 1, image.height_px - 1}, clicked);
  if (pattern.status != PatternStatus::taught)
    throw std::invalid_argument(
        concat({options.pattern, ": this patch is no mark: ", name_of(pattern.status)}));
  return pattern;
}

Json mark_json(const MarkFinding& mark) {
  return {{"u_px", mark.u_px.x()},
          {"v_px", mark.u_px.y()},
          {"suu", mark.covariance_px2(0, 0)},
          {"svv", mark.covariance_px2(1, 1)},
          {"suv", mark.covariance_px2(0, 1)},
          {"diameter_px", mark.diameter_px},
          {"axis_ratio", mark.axis_ratio},
          {"direction_deg", mark.direction_rad * 180 / std::numbers::pi},
          {"contrast", mark.contrast},
          {"blur_px", mark.blur_px},
          {"outline_share", mark.outline_share},
          {"radius_share", mark.radius_share},
          {"quality", mark.quality}};
}

std::string table_of_marks(const std::vector<MarkFinding>& marks) {
  std::ostringstream text;
  text << std::fixed << "      u px       v px  sigma px   size px  ratio  direction  contrast  quality\n";
  for (const MarkFinding& mark : marks)
    text << std::setprecision(3) << std::setw(10) << mark.u_px.x() << ' ' << std::setw(10) << mark.u_px.y()
         << std::setprecision(4) << std::setw(10) << std::sqrt(mark.covariance_px2.trace() / 2)
         << std::setprecision(2) << std::setw(10) << mark.diameter_px << std::setw(7) << mark.axis_ratio
         << std::setprecision(1) << std::setw(11) << mark.direction_rad * 180 / std::numbers::pi
         << std::setw(10) << mark.contrast << std::setprecision(2) << std::setw(9) << mark.quality << "\n";
  return text.str();
}

void write_overlay(const Options& options, const ImageView& image, const MarkSearch& search,
                   const AllMarks& marks) {
  std::vector<MarkOverlay> drawn;
  for (const MarkFinding& mark : marks.found) drawn.push_back({"", search, mark});
  if (drawn.empty()) drawn.push_back({options.kind, search, marks.nearest});
  const std::vector<std::uint8_t> png = overlay_png(image, drawn);
  std::ofstream file(options.overlay, std::ios::binary);
  file.write(reinterpret_cast<const char*>(png.data()), static_cast<std::streamsize>(png.size()));
  file.close();
  if (!file) throw std::runtime_error(concat({options.overlay, ": cannot be written"}));
}

Answer find(const Options& options) {
  check(options);
  const StoredPicture picture = load_deep_image(options.image);
  const Pattern pattern = taught(options);
  const MarkSearch search = search_of(options, view_of(picture), pattern);
  const AllMarks marks = find_all_marks(view_of(picture), search);
  if (marks.found.empty() && marks.nearest.status == MarkStatus::not_searched)
    throw std::invalid_argument(reason_text(marks.nearest, search));
  if (!options.overlay.empty()) write_overlay(options, view_of(picture), search, marks);
  if (marks.found.empty()) {
    Answer answer = failure(reason_text(marks.nearest, search));
    answer.json["name"] = name_of(marks.nearest.status);
    answer.json["marks"] = Json::array();
    return answer;
  }
  Json json = {{"status", "ok"}, {"reason", ""}, {"marks", Json::array()}};
  for (const MarkFinding& mark : marks.found) json["marks"].push_back(mark_json(mark));
  return {done, json, table_of_marks(marks.found)};
}

void add_options(cli::Verb verb, Options& options) {
  std::vector<std::string> words;
  for (const auto& [name, kind] : kinds) words.emplace_back(name);
  verb.add_option("--image", options.image, "PNG, JPEG, TIFF or PGM, 8 or 16 bit, colour is made grey")
      .required();
  verb.add_option("--kind", options.kind, "what to look for (circle)").one_of(words);
  const VerbOption bright =
      verb.add_flag("--bright", options.search.bright, "brighter than what surrounds it");
  verb.add_flag("--dark", options.dark, "darker than what surrounds it (default)").excludes(bright);
  verb.add_option("--window", options.window, "x,y,w,h: first column and row, width and height, px")
      .delimiter(',')
      .expected(4);
  verb.add_option("--min-diameter", options.min_diameter, "px (8)").range(3.0, 1e5);
  verb.add_option("--max-diameter", options.max_diameter,
                  "px (half of the picture, or the window's diagonal)")
      .range(3.0, 1e5);
  verb.add_option("--min-axis-ratio", options.search.min_axis_ratio, "shorter by longer axis (0.3)")
      .range(0.01, 1.0);
  verb.add_option("--min-contrast", options.search.min_contrast, "grey levels of 255 (15)").range(1.0, 255.0);
  verb.add_option("--max-blur", options.search.max_blur_px, "sigma of the edges, px (4)").range(0.3, 20.0);
  verb.add_option("--inner", options.inner, "ring: inner radii by the outer one, descending").delimiter(',');
  verb.add_option("--direction", options.direction, "degrees, see below (0)").range(-360.0, 360.0);
  verb.add_option("--direction-tolerance", options.direction_tolerance, "degrees (180: any)")
      .range(0.0, 180.0);
  verb.add_option("--opening", options.opening, "degrees (90), within 20").range(10.0, 350.0);
  verb.add_option("--template", options.pattern, "picture of the patch to look for");
  verb.add_option("--click", options.click, "u,v: its point, px in the patch (its middle)")
      .delimiter(',')
      .expected(2);
  verb.add_option("--overlay", options.overlay, "writes a PNG of the picture with what was found");
  verb.add_flag("--json", options.json,
                "one JSON object on stdout: status, reason, marks [{u_px, v_px, suu, svv, suv, diameter_px,\n"
                "axis_ratio, direction_deg, contrast, blur_px, outline_share, radius_share, quality}]");
}

}  // namespace

void add_find(cli::Verb app, int& exit_status) {
  auto options = std::make_shared<Options>();
  const Verb verb = app.add_subcommand("find", "Marks in a picture, to hundredths of a pixel");
  add_options(verb, *options);
  verb.footer(find_help);
  verb.callback(
      [options, &exit_status] { exit_status = run([&] { return find(*options); }, options->json); });
}

}  // namespace zeropose
