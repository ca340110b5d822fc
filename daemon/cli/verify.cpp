#include "daemon/cli/verify.h"

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <memory>
#include <optional>
#include <sstream>

#include "config/cell.h"
#include "config/csv.h"
#include "config/records.h"
#include "config/table_columns.h"
#include "config/text.h"
#include "daemon/cli/answer.h"
#include "daemon/cli/convert.h"
#include "measure/code.h"
#include "measure/verification.h"

namespace zeropose {
namespace {

using namespace cli;

constexpr const char* verify_help =
    R"(The object stands at its zero. points.csv: columns x_mm y_mm z_mm, as measured in the world by another system (laser
tracker, measuring arm), and mark or point: the name of a mark or of an application point of the job. Expected is
X_WO0 of the job's zero measurement (--state: the daemon's state directory) times the place in the cell file;
--pose takes another pose, e.g. X_WO of one measurement.
error_mm is measured minus expected by the drawn place and decides: the robot works at application points, which
have no compensation, so the pose itself must be right. compensated_mm is the same with the mark's compensation of
the zero measurement: where it is small and error_mm is large, the mark is off its drawing.
Example: points.csv
  point, x_mm, y_mm, z_mm
  front left, -300.12, -749.95, 200.08
  zeropose verify --cell cell.json --points points.csv --state /var/lib/zeropose --json
Exit status: 0 all points within --max-mm, 1 they are not, or there is no zero (with the reason), 2 wrong usage or
unreadable input.)";

struct Options {
  std::string cell, points, state, job;
  std::optional<std::string> pose;
  double max_mm = 1;
  bool json = false;
};

const Job& job_of(const Cell& cell, const std::string& name) {
  if (name.empty()) return cell.jobs.front();
  std::string names;
  for (const Job& job : cell.jobs) {
    if (job.name == name) return job;
    names += (names.empty() ? "" : ", ") + job.name;
  }
  throw std::invalid_argument(concat({"--job: found ", in_quotes(name), ", expected one of: ", names}));
}

// The place of a mark or point of the job; a mistake where it has none of this name.
void look_up(CsvTable& table, std::size_t row, const Job& job, const std::optional<ZeroRecord>& zero,
             VerificationPoint& point) {
  const bool is_mark = !table.is_blank(row, "mark");
  const char* column = is_mark ? "mark" : "point";
  point.name = table.text(row, column);
  if (point.name.empty()) return;
  if (is_mark && !table.is_blank(row, "point"))
    table.add_mistake(row, "point", in_quotes(table.text(row, "point")) + " beside a mark", "one of both");
  const auto mark = std::ranges::find(job.marks, point.name, &Mark::name);
  const auto application = std::ranges::find(job.application_points, point.name, &ApplicationPoint::name);
  if (is_mark && mark != job.marks.end()) {
    point.p_O_mm = mark->p_O_mm;
    if (zero) point.compensation_O_mm = zero->zero.compensation_O_mm[std::size_t(mark - job.marks.begin())];
  } else if (!is_mark && application != job.application_points.end()) {
    point.p_O_mm = application->p_O_mm;
  } else {
    table.add_mistake(row, column, in_quotes(point.name),
                      concat({is_mark ? "a mark" : "an application point", " of job ", in_quotes(job.name)}));
  }
}

std::vector<VerificationPoint> load_points(const Options& options, const Job& job,
                                           const std::optional<ZeroRecord>& zero) {
  CsvTable table = load_csv(options.points, {{"x_mm", "y_mm", "z_mm"}, {"mark", "point"}});
  std::vector<VerificationPoint> points;
  for (std::size_t row = 0; row < table.rows(); ++row) {
    VerificationPoint point;
    look_up(table, row, job, zero, point);
    point.measured_W_mm = {table.number(row, "x_mm", -largest_mm, largest_mm),
                           table.number(row, "y_mm", -largest_mm, largest_mm),
                           table.number(row, "z_mm", -largest_mm, largest_mm)};
    points.push_back(point);
  }
  table.throw_if_wrong();
  return points;
}

Json point_json(const VerificationPoint& point, const VerificationError& error) {
  return {{"point", point.name},
          {"error_mm", json_of(error.error_W_mm)},
          {"distance_mm", error.error_W_mm.norm()},
          {"compensated_mm", json_of(error.compensated_W_mm)}};
}

Json verify_json(const Job& job, const Pose& X_WO, const std::vector<VerificationPoint>& points,
                 const Verification& result) {
  Json json = {{"status", result.ok ? "ok" : "failed"},
               {"reason", result.reason},
               {"verdict", result.ok ? "within the limit" : "beyond the limit"},
               {"date", iso8601_utc(std::chrono::system_clock::now())},
               {"job", job.name},
               {"X_WO", six_of(X_WO)},
               {"points", Json::array()},
               {"worst", points[result.worst].name},
               {"worst_mm", result.worst_mm},
               {"rms_mm", result.rms_mm},
               {"mean_mm", json_of(result.mean_W_mm)}};
  for (std::size_t i = 0; i < points.size(); ++i)
    json["points"].push_back(point_json(points[i], result.errors[i]));
  return json;
}

std::string verify_text(const std::vector<VerificationPoint>& points, const Verification& result,
                        double max_mm) {
  std::ostringstream text;
  if (!result.ok) text << "no: " << result.reason << "\n";
  text << "measured minus expected, x y z and distance, mm:\n";
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Eigen::Vector3d& error = result.errors[i].error_W_mm;
    const double length = error.norm();
    text << table_of({error.data(), 3}) << table_of({&length, 1}) << "  " << points[i].name << "\n";
  }
  text << "worst " << points[result.worst].name << " " << result.worst_mm << " mm, rms " << result.rms_mm
       << " mm, limit " << max_mm << " mm\n";
  return text.str();
}

Answer verify_cell(const Options& options) {
  if (options.state.empty() && !options.pose)
    throw std::invalid_argument("--state or --pose is required: where does the object stand?");
  const Cell cell = load_cell(options.cell);
  const Job& job = job_of(cell, options.job);
  if (job.gaps || job.wheel)
    return failure(concat({"job ", job.name, job.gaps ? " evens gaps" : " measures a wheel",
                           ": it has no points of an object to verify"}));
  std::optional<ZeroRecord> zero;
  if (!options.state.empty()) {
    if (!std::filesystem::is_directory(options.state))
      throw std::invalid_argument(options.state +
                                  ": no such folder; --state is the daemon's state directory");
    StoredZero stored = load_zero_for(options.state, cell, job);
    if (stored.code != Code::ok) {
      Answer answer = failure(stored.reason);
      answer.json["code"] = static_cast<int>(stored.code);
      return answer;
    }
    zero = std::move(stored.record);
  }
  const std::vector<VerificationPoint> points = load_points(options, job, zero);
  if (points.empty()) return failure("the table has no points");
  const Pose X_WO = options.pose ? *pose_of_option(options.pose, "--pose") : zero->zero.X_WO0;
  const Verification result = verify(X_WO, points, options.max_mm);
  Answer answer{result.ok ? done : no_answer, verify_json(job, X_WO, points, result),
                verify_text(points, result, options.max_mm)};
  answer.json["max_mm"] = options.max_mm;
  answer.json["zero_time"] = zero ? Json(zero->time_utc) : Json();
  return answer;
}

}  // namespace

void add_verify(cli::Verb app, int& exit_status) {
  auto options = std::make_shared<Options>();
  const Verb verb = app.add_subcommand("verify", "A cell against points that another system measured");
  verb.add_option("--cell", options->cell, "the cell file").required();
  verb.add_option("--points", options->points, "CSV: mark or point, x_mm y_mm z_mm measured in the world")
      .required();
  const VerbOption state =
      verb.add_option("--state", options->state, "the daemon's state directory, with the zero");
  verb.add_option("--pose", options->pose, "x,y,z,rx,ry,rz: X_WO instead of a zero").excludes(state);
  verb.add_option("--job", options->job, "its name (the first one)");
  verb.add_option("--max-mm", options->max_mm, "largest error of a point (1)").range(1e-6, 1e6);
  verb.add_flag("--json", options->json,
                "one JSON object on stdout: status, reason, verdict, date, X_WO, points [{point, error_mm,\n"
                "distance_mm, compensated_mm}], worst, worst_mm, rms_mm, mean_mm, max_mm, zero_time");
  verb.footer(verify_help);
  verb.callback(
      [options, &exit_status] { exit_status = run([&] { return verify_cell(*options); }, options->json); });
}

}  // namespace zeropose
