#include "daemon/cli/frame.h"

#include <memory>
#include <sstream>

#include "calib/measured_frame.h"
#include "config/csv.h"
#include "config/table_columns.h"
#include "config/text.h"
#include "daemon/cli/answer.h"

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
later is p_W = X_WT p_T (X_WT is answered as well).
Example: points.csv
  point, role, x_mm, y_mm, z_mm
  corner, origin, 1203.44, 88.10, -512.30
  rail, x, 3203.31, 91.25, -511.87
  floor, xy, 1300.02, 1590.77, -509.41
  zeropose frame --points points.csv --sigma-mm 0.03 --json
Exit status: 0 done, 1 the points give no frame (status and reason say why), 2 wrong usage or unreadable input.)";

struct Options {
  std::string points;
  double sigma_mm = 0;
  bool json = false;
};

FrameRole role_of(CsvTable& table, std::size_t row) {
  const std::string role = table.text(row, "role");
  if (role == "origin") return FrameRole::origin;
  if (role == "x") return FrameRole::x_axis;
  if (role != "xy" && !role.empty()) table.add_mistake(row, "role", in_quotes(role), "origin, x or xy");
  return FrameRole::xy_plane;
}

std::vector<FramePoint> load_points(const std::string& path) {
  CsvTable table = load_csv(path, {{"point", "role", "x_mm", "y_mm", "z_mm"}, {}});
  std::vector<FramePoint> points;
  for (std::size_t row = 0; row < table.rows(); ++row)
    points.push_back({table.text(row, "point"),
                      role_of(table, row),
                      {table.number(row, "x_mm", -largest_mm, largest_mm),
                       table.number(row, "y_mm", -largest_mm, largest_mm),
                       table.number(row, "z_mm", -largest_mm, largest_mm)}});
  table.throw_if_wrong();
  return points;
}

Answer answer_of(const std::vector<FramePoint>& points, const MeasuredFrame& frame) {
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
                 {"residuals", Json::array()}};
  std::ostringstream text;
  text << "X_TW, mm and degrees:\n" << table_of(six_of(frame.X_TW)) << "\n";
  if (known) text << "sigma along and about T's axes:\n" << table_of({sigma.data(), 6}) << "\n";
  text << "beside what their role says, axes of W, mm (redundancy " << frame.redundancy << "):\n";
  for (std::size_t i = 0; i < points.size(); ++i) {
    answer.json["residuals"].push_back(
        {{"point", points[i].name}, {"residual_mm", json_of(frame.residuals_W_mm[i])}});
    text << table_of({frame.residuals_W_mm[i].data(), 3}) << "  " << points[i].name << "\n";
  }
  answer.text = text.str();
  return answer;
}

}  // namespace

void add_frame(cli::Verb app, int& exit_status) {
  auto options = std::make_shared<Options>();
  const Verb verb = app.add_subcommand("frame", "A cell's world frame from points of a measuring system");
  verb.add_option("--points", options->points, "CSV: point role x_mm y_mm z_mm").required();
  verb.add_option("--sigma-mm", options->sigma_mm,
                  "of one measured coordinate; without it from the residuals, where there are any")
      .range(1e-6, 100.0);
  verb.add_flag(
      "--json", options->json,
      "one JSON object on stdout: status, reason, X_TW, X_WT, sigma, sigma_mm, redundancy, residuals\n"
      "[{point, residual_mm}]");
  verb.footer(frame_help);
  verb.callback([options, &exit_status] {
    const auto answer = [&] {
      const std::vector<FramePoint> points = load_points(options->points);
      return answer_of(points, measured_frame(points, options->sigma_mm));
    };
    exit_status = run(answer, options->json);
  });
}

}  // namespace zeropose
