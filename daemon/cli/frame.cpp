#include "daemon/cli/frame.h"

#include <memory>
#include <sstream>

#include "calib/measured_frame.h"
#include "config/csv.h"
#include "config/table_columns.h"
#include "config/text.h"
#include "daemon/cli/answer.h"
#include "daemon/cli/output.h"
#include "daemon/cli/point_table.h"

namespace zeropose {
namespace {

using namespace cli;

constexpr const char* frame_help =
    R"(The world frame W in the frame T of a measuring system (laser tracker): X_TW, by the 3-2-1 rule, with more points by
least squares. points.csv: columns point role x_mm y_mm z_mm, role one of
  origin   the point is the frame's origin
  x        it lies on the positive x axis
  xy       it lies in the xy plane; these points, taken together, lie on the side of positive y
Every role needs a point. Three points fix the frame and check nothing: residuals need a fourth. A point p_T measured
later is p_W = X_WT p_T (X_WT is answered as well); points of the table without a role are carried into W like that,
and --output writes all of them for verify, recalibrate, calibrate sensor. Measured from several stations: see zeropose
network.
Example: points.csv
  point, role, x_mm, y_mm, z_mm
  corner, origin, 1203.44, 88.10, -512.30
  rail, x, 3203.31, 91.25, -511.87
  floor, xy, 1300.02, 1590.77, -509.41
  zeropose frame --points points.csv --sigma-mm 0.03 --json
Exit status: 0 done, 1 the points give no frame (status and reason say why), 2 wrong usage or unreadable input.)";

struct Options {
  std::string points, output;
  double sigma_mm = 0;
  bool replace = false, json = false;
};

struct Points {
  std::vector<FramePoint> of_frame;
  std::vector<TablePoint> all;  // in T, in the order of the table
};

FrameRole role_of(CsvTable& table, std::size_t row) {
  const std::string role = table.text(row, "role");
  if (role == "origin") return FrameRole::origin;
  if (role == "x") return FrameRole::x_axis;
  if (role != "xy") table.add_mistake(row, "role", in_quotes(role), "origin, x or xy");
  return FrameRole::xy_plane;
}

Points load_points(const std::string& path) {
  CsvTable table = load_csv(path, {{"point", "role", "x_mm", "y_mm", "z_mm"}, {}});
  Points points;
  for (std::size_t row = 0; row < table.rows(); ++row) {
    const std::string name = table.text(row, "point");
    const Eigen::Vector3d p_T_mm(table.number(row, "x_mm", -largest_mm, largest_mm),
                                 table.number(row, "y_mm", -largest_mm, largest_mm),
                                 table.number(row, "z_mm", -largest_mm, largest_mm));
    const bool carried = table.is_blank(row, "role");
    points.all.push_back({name, carried ? "" : table.text(row, "role"), p_T_mm});
    if (!carried) points.of_frame.push_back({name, role_of(table, row), p_T_mm});
  }
  table.throw_if_wrong();
  return points;
}

std::vector<TablePoint> in_world(std::vector<TablePoint> points, const MeasuredFrame& frame) {
  for (TablePoint& point : points) point.p_mm = frame.X_TW.inverse() * point.p_mm;
  return points;
}

Answer answer_of(const Points& table, const MeasuredFrame& frame) {
  const std::vector<FramePoint>& points = table.of_frame;
  if (frame.status != MeasuredFrameStatus::ok) return failure(frame.reason);
  Vector6 sigma = frame.covariance.diagonal().cwiseSqrt();
  sigma.tail<3>() *= degrees_per_radian;
  const bool known = frame.sigma_mm > 0;
  Answer answer;
  answer.json = {{"status", "ok"},
                 {"reason", ""},
                 {"X_TW", six_of(frame.X_TW)},
                 {"X_WT", six_of(frame.X_TW.inverse())},
                 {"sigma", known ? json_of(sigma) : Json()},
                 {"sigma_mm", known ? Json(frame.sigma_mm) : Json()},
                 {"redundancy", frame.redundancy},
                 {"residuals", Json::array()},
                 {"points", Json::array()}};
  std::ostringstream text;
  text << "X_TW, mm and degrees:\n" << table_of(six_of(frame.X_TW)) << "\n";
  if (known) text << "sigma along and about T's axes:\n" << table_of({sigma.data(), 6}) << "\n";
  text << "beside what their role says, axes of W, mm (redundancy " << frame.redundancy << "):\n";
  for (std::size_t i = 0; i < points.size(); ++i) {
    answer.json["residuals"].push_back(
        {{"point", points[i].name}, {"residual_mm", json_of(frame.residuals_W_mm[i])}});
    text << table_of({frame.residuals_W_mm[i].data(), 3}) << "  " << points[i].name << "\n";
  }
  for (const TablePoint& point : in_world(table.all, frame)) {
    answer.json["points"].push_back({{"point", point.name}, {"p_W", json_of(point.p_mm)}});
    if (point.role.empty())
      text << "in W, mm:" << table_of({point.p_mm.data(), 3}) << "  " << point.name << "\n";
  }
  answer.text = text.str();
  return answer;
}

}  // namespace

void add_frame(cli::Verb app, int& exit_status) {
  auto options = std::make_shared<Options>();
  const Verb verb = app.add_subcommand("frame", "A cell's world frame from points of a measuring system");
  verb.add_option("--points", options->points, "CSV: point role x_mm y_mm z_mm; no role: carried over")
      .required();
  verb.add_option("--sigma-mm", options->sigma_mm,
                  "of one measured coordinate; without it from the residuals, where there are any")
      .range(1e-6, 100.0);
  verb.add_option("--output", options->output, "writes the points in W: point x_mm y_mm z_mm");
  verb.add_flag("--replace", options->replace, "overwrite it");
  verb.add_flag(
      "--json", options->json,
      "one JSON object on stdout: status, reason, X_TW, X_WT, sigma, sigma_mm, redundancy, residuals\n"
      "[{point, residual_mm}], points [{point, p_W}]");
  verb.footer(frame_help);
  verb.callback([options, &exit_status] {
    const auto answer = [&] {
      if (!options->output.empty()) refuse_existing(options->output, options->replace);
      const Points points = load_points(options->points);
      const MeasuredFrame frame = measured_frame(points.of_frame, options->sigma_mm);
      if (frame.status == MeasuredFrameStatus::ok && !options->output.empty())
        replace_file(options->output, point_table(in_world(points.all, frame), false));
      return answer_of(points, frame);
    };
    exit_status = run(answer, options->json);
  });
}

}  // namespace zeropose
