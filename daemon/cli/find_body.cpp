#include "daemon/cli/find_body.h"

#include <fstream>
#include <iomanip>
#include <memory>
#include <sstream>
#include <stdexcept>

#include "config/body_tables.h"
#include "config/camera_file.h"
#include "config/text.h"
#include "daemon/cli/grey_image.h"
#include "daemon/overlay.h"

namespace zeropose {
namespace {

using namespace cli;

constexpr const char* find_body_help =
    R"(The marks of a calibration body (planes with circle marks, at any angle to each other) in a picture, each with its
number. body.csv: columns mark x_mm y_mm z_mm, optional radius_mm and nx ny nz (the normal of the mark's plane,
towards the side from which it is seen). Without normals the planes are found from the layout: marks within a
twentieth of the spacing of the plane through three neighbours, the plane with most marks first. Marks stand in
rows and columns, which need not be regular.
The camera may stand anywhere and be turned by any angle; its internals need to be known about only: --focal-px
within 20 %, or --camera, or nothing. Marks may be hidden and there may be other round things. The numbering must
explain clearly more discs than the next best one (explained, next_best), else there is no answer: a wrong number is
never given. A table with two axes exchanged (left-handed) is named.
u_px v_px is the centre of a mark's image, which is not the image of its centre where the mark is seen from the
side: with --radius-mm (or radius_mm in body.csv) the calibration corrects this.
Examples:
  zeropose find-body --image body.png --body body.csv --focal-px 4200 --radius-mm 8 --csv points.csv --overlay found.png
  zeropose calibrate points --points points.csv --width 768 --height 572
Exit status: 0 done, 1 no body found (status and reason say why), 2 wrong usage or unreadable input.)";

struct Options {
  BodyOptions body;
  std::string csv;
  bool json = false;
};

void write_file(const std::string& path, const char* bytes, std::size_t count) {
  std::ofstream file(path, std::ios::binary);
  file.write(bytes, static_cast<std::streamsize>(count));
  file.close();
  if (!file) throw std::runtime_error(concat({path, ": cannot be written"}));
}

Json point_json(const BodyMark& mark, const BodyPoint& point) {
  return {{"mark", mark.name},
          {"x_mm", mark.p_B_mm.x()},
          {"y_mm", mark.p_B_mm.y()},
          {"z_mm", mark.p_B_mm.z()},
          {"u_px", point.u_px.x()},
          {"v_px", point.u_px.y()},
          {"suu", point.covariance_px2(0, 0)},
          {"svv", point.covariance_px2(1, 1)},
          {"suv", point.covariance_px2(0, 1)},
          {"radius_mm", mark.radius_mm},
          {"nx", point.normal_B.x()},
          {"ny", point.normal_B.y()},
          {"nz", point.normal_B.z()}};
}

std::string table_of_points(const FoundBody& found) {
  std::ostringstream text;
  text << "mark,x_mm,y_mm,z_mm,u_px,v_px,suu,svv,suv,radius_mm,nx,ny,nz\n";
  for (const BodyPoint& point : found.result.points) {
    const BodyMark& mark = found.marks[point.mark];
    text << mark.name << std::setprecision(10) << ',' << mark.p_B_mm.x() << ',' << mark.p_B_mm.y() << ','
         << mark.p_B_mm.z() << ',' << std::fixed << std::setprecision(5) << point.u_px.x() << ','
         << point.u_px.y() << std::scientific << std::setprecision(4) << ',' << point.covariance_px2(0, 0)
         << ',' << point.covariance_px2(1, 1) << ',' << point.covariance_px2(0, 1) << std::defaultfloat
         << std::setprecision(10) << ',' << mark.radius_mm << ',' << point.normal_B.x() << ','
         << point.normal_B.y() << ',' << point.normal_B.z() << "\n";
  }
  return text.str();
}

std::string summary_of(const FoundBody& found) {
  const BodyResult& result = found.result;
  if (result.status != BodyStatus::found) return concat({"no answer: ", result.reason, "\n"});
  std::ostringstream text;
  text << table_of_points(found) << "# " << result.points.size() << " of " << found.marks.size()
       << " marks; the next best numbering explains " << result.next_best << "\n";
  return text.str();
}

Answer find(const Options& options) {
  const FoundBody found = find_body_in(options.body);
  const bool good = found.result.status == BodyStatus::found;
  if (good && !options.csv.empty()) {
    const std::string table = table_of_points(found);
    write_file(options.csv, table.data(), table.size());
  }
  return {good ? done : no_answer, body_json(found), summary_of(found)};
}

}  // namespace

namespace cli {

void add_body_options(cli::Verb verb, BodyOptions& options) {
  const VerbOption camera =
      verb.add_option("--camera", options.camera, "camera JSON: the internals about as they are");
  verb.add_option("--camera-name", options.camera_name, "of the camera, where that file holds several");
  verb.add_option("--focal-px", options.focal_px,
                  "focal length in px within 20 %, where there is no camera file")
      .range(1.0, 1e6)
      .excludes(camera);
  verb.add_option("--radius-mm", options.radius_mm, "of the marks whose radius the table does not say")
      .range(1e-6, 1e6);
  verb.add_option("--overlay", options.overlay, "writes a PNG of the image with the marks and their numbers");
}

FoundBody find_body_in(const BodyOptions& options) {
  FoundBody found;
  found.marks = load_body(options.body);
  for (BodyMark& mark : found.marks)
    if (mark.radius_mm == 0) mark.radius_mm = options.radius_mm;
  BodyProblem problem;
  problem.marks = found.marks;
  problem.focal_px = options.focal_px;
  const StoredPicture picture = load_grey_image(options.image);
  const ImageView image = view_of(picture);
  if (!options.camera.empty()) {
    problem.camera = load_camera(options.camera, options.camera_name).camera.model;
    if (problem.camera->width_px != image.width_px || problem.camera->height_px != image.height_px)
      throw std::invalid_argument(
          concat({options.image, ": found ", std::to_string(image.width_px), " x ",
                  std::to_string(image.height_px), " px, expected ", std::to_string(problem.camera->width_px),
                  " x ", std::to_string(problem.camera->height_px), " px as in ", options.camera}));
  }
  found.width_px = image.width_px;
  found.height_px = image.height_px;
  found.result = find_body(image, problem);
  if (found.result.status == BodyStatus::wrong_problem || found.result.status == BodyStatus::no_layout)
    throw std::invalid_argument(concat({options.body, ": ", found.result.reason}));
  if (!options.overlay.empty()) {
    const std::vector<std::uint8_t> png = overlay_png(image, found.result, found.marks);
    write_file(options.overlay, reinterpret_cast<const char*>(png.data()), png.size());
  }
  return found;
}

Json body_json(const FoundBody& found) {
  const BodyResult& result = found.result;
  const bool good = result.status == BodyStatus::found;
  Json json = {{"status", good ? "ok" : "failed"}, {"reason", result.reason},
               {"name", name_of(result.status)},   {"points", Json::array()},
               {"missing", Json::array()},         {"discs", result.discs},
               {"explained", result.explained},    {"next_best", result.next_best}};
  for (const BodyPoint& point : result.points)
    json["points"].push_back(point_json(found.marks[point.mark], point));
  for (const std::size_t mark : result.missing) json["missing"].push_back(found.marks[mark].name);
  return json;
}

std::vector<CalibrationPoint> calibration_points(const FoundBody& found) {
  std::vector<CalibrationPoint> points;
  for (const BodyPoint& point : found.result.points) {
    const BodyMark& mark = found.marks[point.mark];
    points.push_back({mark.p_B_mm, point.u_px, point.covariance_px2, mark.radius_mm, point.normal_B});
  }
  return points;
}

}  // namespace cli

void add_find_body(cli::Verb app, int& exit_status) {
  auto options = std::make_shared<Options>();
  const Verb verb = app.add_subcommand("find-body", "A picture of a calibration body to numbered points");
  verb.add_option("--image", options->body.image, "PNG, JPEG, TIFF or PGM, 8 or 16 bit, colour is made grey")
      .required();
  verb.add_option("--body", options->body.body, "CSV: mark x_mm y_mm z_mm [radius_mm nx ny nz]").required();
  add_body_options(verb, options->body);
  verb.add_option("--csv", options->csv,
                  "writes the points: mark x_mm y_mm z_mm u_px v_px suu svv suv radius_mm nx ny nz");
  verb.add_flag("--json", options->json,
                "one JSON object on stdout: status, reason, points [{mark, x_mm, y_mm, z_mm, u_px, v_px, "
                "suu, svv, suv,\n"
                "radius_mm, nx, ny, nz}], missing [mark], discs, explained, next_best");
  verb.footer(find_body_help);
  verb.callback(
      [options, &exit_status] { exit_status = run([&] { return find(*options); }, options->json); });
}

}  // namespace zeropose
