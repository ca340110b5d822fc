#include "daemon/cli/find_board.h"

#include <fstream>
#include <iomanip>
#include <memory>
#include <sstream>
#include <stdexcept>

#include "config/text.h"
#include "daemon/cli/answer.h"
#include "daemon/cli/grey_image.h"
#include "daemon/cli/help.h"
#include "daemon/overlay.h"
#include "measure/board.h"

namespace zeropose {
namespace {

using namespace cli;

struct Options {
  std::string image, board = "circles", csv, overlay;
  BoardProblem problem;
  double diameter_mm = 0;
  bool json = false;
};

Json index_json(const BoardIndex& at) { return {{"row", at.row}, {"col", at.col}}; }

Json point_json(const BoardPoint& point, const Options& options) {
  Json json = index_json(point.at);
  json["x_mm"] = point.p_B_mm.x();
  json["y_mm"] = point.p_B_mm.y();
  json["z_mm"] = point.p_B_mm.z();
  json["u_px"] = point.u_px.x();
  json["v_px"] = point.u_px.y();
  json["suu"] = point.covariance_px2(0, 0);
  json["svv"] = point.covariance_px2(1, 1);
  json["suv"] = point.covariance_px2(0, 1);
  if (options.diameter_mm > 0) json["radius_mm"] = options.diameter_mm / 2;
  return json;
}

Json board_json(const BoardResult& result, const Options& options) {
  const bool good = result.status == BoardStatus::found;
  Json json = {{"status", good ? "ok" : "failed"}, {"reason", result.reason},
               {"name", name_of(result.status)},   {"board", name_of(options.problem.kind)},
               {"rows", options.problem.rows},     {"cols", options.problem.cols},
               {"points", Json::array()},          {"missing", Json::array()}};
  for (const BoardPoint& point : result.points) json["points"].push_back(point_json(point, options));
  for (const BoardIndex& at : result.missing) json["missing"].push_back(index_json(at));
  if (good) {
    json["equivalent_readings"] = result.equivalent_readings;
    json["place_known"] = result.place_known;
  }
  return json;
}

std::string table_of_points(const BoardResult& result, const Options& options) {
  std::ostringstream text;
  text << "x_mm,y_mm,z_mm,u_px,v_px,suu,svv,suv" << (options.diameter_mm > 0 ? ",radius_mm" : "") << "\n";
  for (const BoardPoint& point : result.points) {
    text << std::setprecision(10) << point.p_B_mm.x() << ',' << point.p_B_mm.y() << ',' << point.p_B_mm.z()
         << ',' << std::fixed << std::setprecision(5) << point.u_px.x() << ',' << point.u_px.y()
         << std::scientific << std::setprecision(4) << ',' << point.covariance_px2(0, 0) << ','
         << point.covariance_px2(1, 1) << ',' << point.covariance_px2(0, 1) << std::defaultfloat
         << std::setprecision(10);
    if (options.diameter_mm > 0) text << ',' << options.diameter_mm / 2;
    text << "\n";
  }
  return text.str();
}

void write_file(const std::string& path, const char* bytes, std::size_t count) {
  std::ofstream file(path, std::ios::binary);
  file.write(bytes, static_cast<std::streamsize>(count));
  file.close();
  if (!file) throw std::runtime_error(concat({path, ": cannot be written"}));
}

std::string summary_of(const BoardResult& result, const Options& options) {
  if (result.status != BoardStatus::found) return concat({"no answer: ", result.reason, "\n"});
  std::ostringstream text;
  text << table_of_points(result, options) << "# " << result.points.size() << " points";
  if (!result.reason.empty()) text << "; " << result.reason;
  if (result.equivalent_readings > 1 && result.place_known)
    text << "; the board looks the same from " << result.equivalent_readings
         << " sides, row 0 column 0 is the corner nearest to the image's top left";
  text << "\n";
  return text.str();
}

BoardKind kind_of(const std::string& name) {
  for (const BoardKind kind : {BoardKind::circles, BoardKind::asymmetric_circles, BoardKind::chessboard})
    if (name == name_of(kind)) return kind;
  throw std::invalid_argument(concat({"--board: found ", in_quotes(name), ", which is no board"}));
}

Answer find(Options options) {
  options.problem.kind = kind_of(options.board);
  const StoredPicture image = load_grey_image(options.image);
  const BoardResult result = find_board(view_of(image), options.problem);
  if (result.status == BoardStatus::wrong_problem) throw std::invalid_argument(result.reason);
  if (!options.overlay.empty()) {
    const std::vector<std::uint8_t> png = overlay_png(view_of(image), result);
    write_file(options.overlay, reinterpret_cast<const char*>(png.data()), png.size());
  }
  const bool good = result.status == BoardStatus::found;
  if (good && !options.csv.empty()) {
    const std::string table = table_of_points(result, options);
    write_file(options.csv, table.data(), table.size());
  }
  return {good ? done : no_answer, board_json(result, options), summary_of(result, options)};
}

void add_options(cli::Verb verb, Options& options) {
  verb.add_option("--image", options.image, "PNG, JPEG, TIFF or PGM, 8 or 16 bit, colour is made grey")
      .required();
  verb.add_option("--rows", options.problem.rows, "rows of circles or inner corners")
      .required()
      .range(2, 1000);
  verb.add_option("--cols", options.problem.cols, "circles or inner corners in a row")
      .required()
      .range(2, 1000);
  verb.add_option("--pitch-mm", options.problem.pitch_mm,
                  "from circle to circle, or a square's side; asymmetric: from row to row")
      .required()
      .range(1e-6, 1e6);
  verb.add_option("--board", options.board, "circles (default), asymmetric-circles or chessboard")
      .one_of({"circles", "asymmetric-circles", "chessboard"});
  verb.add_option("--diameter-mm", options.diameter_mm, "of the circles: adds radius_mm to the points")
      .range(1e-6, 1e6);
  verb.add_flag("--partial", options.problem.partial,
                "accept any part of the board, counted from its own corner");
  verb.add_option("--csv", options.csv,
                  "writes the points: x_mm y_mm z_mm u_px v_px suu svv suv [radius_mm]");
  verb.add_option("--overlay", options.overlay,
                  "writes a PNG of the image with the points and their row.column");
  verb.add_flag(
      "--json", options.json,
      "one JSON object on stdout: status, reason, points [{row, col, x_mm, y_mm, z_mm, u_px, v_px, suu,\n"
      "svv, suv, radius_mm}], missing [{row, col}], equivalent_readings, place_known");
}

}  // namespace

void add_find_board(cli::Verb app, int& exit_status) {
  auto options = std::make_shared<Options>();
  const Verb verb =
      app.add_subcommand("find-board", "A picture of a calibration board to points for calibrate");
  add_options(verb, *options);
  verb.footer(find_board_help);
  verb.callback(
      [options, &exit_status] { exit_status = run([&] { return find(*options); }, options->json); });
}

}  // namespace zeropose
