#include "daemon/cli/network.h"

#include <algorithm>
#include <memory>
#include <sstream>

#include "calib/station_network.h"
#include "calib/words.h"
#include "config/csv.h"
#include "config/table_columns.h"
#include "config/text.h"
#include "daemon/cli/answer.h"
#include "daemon/cli/output.h"
#include "daemon/cli/point_table.h"

namespace zeropose {
namespace {

using namespace cli;

constexpr const char* network_help =
    R"(A measuring system (laser tracker) was moved from station to station: the pose X_AS of each station S in the frame
A of the first one (or of --reference), and all points in A, from the points that stations have in common. Every
station needs three, not on a line, with the others together; more check each other. What only one station measured
is carried into A. points.csv: columns station point x_mm y_mm z_mm, in the station's own frame; optional
  sigma_mm  of one coordinate, where rows differ. --sigma-mm is that of the others
  role      origin, x or xy as zeropose frame has it, in one row of the point; goes into --output
A point that contradicts the others is left out and named. Where three stations see it and more, the wrong one of them
is left out; where two see it nobody knows which one is wrong, and the point gets no place.
Nominal coordinates are a station of their own: with --reference and sigma_mm all comes into their frame.
--output writes point, x_mm y_mm z_mm in A, which frame --points (with role), recalibrate --points, calibrate sensor
--points and verify --points (rows of the job's points) read. frame --output carries them on into the world W.
Example: points.csv
  station, point, role, x_mm, y_mm, z_mm
  front, corner, origin, 1203.44, 88.10, -512.30
  front, rail, x, 3203.31, 91.25, -511.87
  front, floor, xy, 1300.02, 1590.77, -509.41
  front, door, , 2650.18, 1204.66, 310.92
  rear, rail, , 386.24, 3058.04, -546.88
  rear, floor, , 2770.74, 2627.60, -544.40
  rear, door, , 1397.39, 2334.60, 275.92
  rear, roof, , 483.59, 2283.93, 870.15
  zeropose network --points points.csv --sigma-mm 0.03 --output in_A.csv --json
  zeropose frame --points in_A.csv --sigma-mm 0.03 --output in_W.csv
Exit status: 0 done, 1 the points give no network (what and reason say why), 2 wrong usage or unreadable input.)";

struct Options {
  std::string points, reference, output;
  double sigma_mm = 0;
  bool replace = false, json = false;
};

struct Input {
  StationNetworkProblem problem;
  std::vector<std::string> roles;  // of the points
  bool has_roles = false;
};

// The index of a name, which is new where it is not there yet.
std::size_t index_in(std::vector<std::string>& names, const std::string& name) {
  const auto found = std::ranges::find(names, name);
  if (found != names.end()) return std::size_t(found - names.begin());
  names.push_back(name);
  return names.size() - 1;
}

void read_role(CsvTable& table, std::size_t row, std::size_t point, Input& input) {
  input.roles.resize(input.problem.points.size());
  if (table.is_blank(row, "role")) return;
  const std::string role = table.text(row, "role");
  if (role != "origin" && role != "x" && role != "xy")
    table.add_mistake(row, "role", in_quotes(role), "origin, x or xy");
  if (!input.roles[point].empty() && input.roles[point] != role)
    table.add_mistake(row, "role", in_quotes(role),
                      concat({"the role that the point has already, ", input.roles[point]}));
  input.roles[point] = role;
}

void read_row(CsvTable& table, std::size_t row, double sigma_mm, bool any_sigma, Input& input) {
  StationNetworkProblem& problem = input.problem;
  StationObservation seen;
  seen.station = index_in(problem.stations, table.text(row, "station"));
  seen.point = index_in(problem.points, table.text(row, "point"));
  seen.p_S_mm = {table.number(row, "x_mm", -largest_mm, largest_mm),
                 table.number(row, "y_mm", -largest_mm, largest_mm),
                 table.number(row, "z_mm", -largest_mm, largest_mm)};
  seen.sigma_mm = table.number_or(row, "sigma_mm", 0, 1e-6, 100);
  if (any_sigma && seen.sigma_mm == 0 && sigma_mm == 0 && table.is_blank(row, "sigma_mm"))
    table.add_mistake(row, "sigma_mm", "nothing", "a number as in other rows, or --sigma-mm");
  read_role(table, row, seen.point, input);
  const auto is_same = [&](const StationObservation& other) {
    return other.station == seen.station && other.point == seen.point;
  };
  if (std::ranges::any_of(problem.observations, is_same) && !problem.points[seen.point].empty())
    table.add_mistake(row, "point", in_quotes(problem.points[seen.point]) + " again",
                      "each point once per station");
  problem.observations.push_back(seen);
}

Input load_input(const Options& options) {
  CsvTable table =
      load_csv(options.points, {{"station", "point", "x_mm", "y_mm", "z_mm"}, {"sigma_mm", "role"}});
  Input input;
  input.has_roles = table.has("role");
  bool any_sigma = false;
  for (std::size_t row = 0; row < table.rows(); ++row) any_sigma |= !table.is_blank(row, "sigma_mm");
  for (std::size_t row = 0; row < table.rows(); ++row)
    read_row(table, row, options.sigma_mm, any_sigma, input);
  table.throw_if_wrong();
  input.problem.sigma_mm = options.sigma_mm;
  if (options.reference.empty()) return input;
  const auto& stations = input.problem.stations;
  const auto found = std::ranges::find(stations, options.reference);
  if (found == stations.end()) {
    std::string names;
    for (const std::string& name : stations) names += (names.empty() ? "" : ", ") + name;
    throw std::invalid_argument(
        concat({"--reference: found ", in_quotes(options.reference), ", expected one of: ", names}));
  }
  input.problem.reference = std::size_t(found - stations.begin());
  return input;
}

bool is_in(const std::vector<std::size_t>& list, std::size_t i) {
  return std::ranges::find(list, i) != list.end();
}

template <typename Matrix>
Json rows_of(const Matrix& matrix) {
  Json rows = Json::array();
  for (Eigen::Index row = 0; row < matrix.rows(); ++row)
    rows.push_back(json_of(Eigen::VectorXd(matrix.row(row))));
  return rows;
}

Vector6 sigma_of(const UncertainPose& pose) {
  Vector6 sigma = pose.covariance.diagonal().cwiseSqrt();
  sigma.tail<3>() *= degrees_per_radian;
  return sigma;
}

Json stations_json(const StationNetworkProblem& problem, const StationNetworkResult& result) {
  Json stations = Json::array();
  for (std::size_t s = 0; s < problem.stations.size(); ++s) {
    int common = 0;
    for (std::size_t i = 0; i < problem.observations.size(); ++i) {
      const StationObservation& seen = problem.observations[i];
      common += seen.station == s && result.points[seen.point].stations > 1 && !is_in(result.removed, i);
    }
    stations.push_back({{"station", problem.stations[s]},
                        {"X_AS", six_of(result.X_AS[s].X)},
                        {"X_SA", six_of(result.X_AS[s].X.inverse())},
                        {"sigma", json_of(sigma_of(result.X_AS[s]))},
                        {"covariance", rows_of(result.X_AS[s].covariance)},
                        {"common_points", common}});
  }
  return stations;
}

Json points_json(const StationNetworkProblem& problem, const StationNetworkResult& result) {
  Json points = Json::array();
  for (std::size_t i = 0; i < problem.points.size(); ++i) {
    const StationNetworkPoint& point = result.points[i];
    points.push_back(
        {{"point", problem.points[i]},
         {"p_A", point.known ? json_of(point.p_A_mm) : Json()},
         {"sigma",
          point.known ? json_of(Eigen::Vector3d(point.covariance_mm2.diagonal().cwiseSqrt())) : Json()},
         {"covariance", point.known ? rows_of(point.covariance_mm2) : Json()},
         {"stations", point.stations}});
  }
  return points;
}

Json observations_json(const StationNetworkProblem& problem, const StationNetworkResult& result) {
  Json observations = Json::array();
  for (std::size_t i = 0; i < result.residuals_A_mm.size(); ++i)
    observations.push_back({{"station", problem.stations[problem.observations[i].station]},
                            {"point", problem.points[problem.observations[i].point]},
                            {"residual_mm", json_of(result.residuals_A_mm[i])},
                            {"removed", is_in(result.removed, i)},
                            {"suspect", is_in(result.suspects, i)}});
  return observations;
}

Json network_json(const StationNetworkProblem& problem, const StationNetworkResult& result) {
  const bool good = result.status == StationNetworkStatus::ok;
  return {{"status", good ? "ok" : "failed"},
          {"reason", result.reason},
          {"what", name_of(result.status)},
          {"reference", problem.stations.empty() ? "" : problem.stations[problem.reference]},
          {"sigma_mm", result.sigma_mm > 0 ? Json(result.sigma_mm) : Json()},
          {"residual_ratio", result.residual_ratio},
          {"rms_mm", result.rms_mm},
          {"redundancy", result.redundancy},
          {"stations", good ? stations_json(problem, result) : Json::array()},
          {"points", good ? points_json(problem, result) : Json::array()},
          {"observations", observations_json(problem, result)}};
}

std::string network_text(const StationNetworkProblem& problem, const StationNetworkResult& result) {
  if (result.status != StationNetworkStatus::ok) return concat({"no answer: ", result.reason, "\n"});
  std::ostringstream text;
  text << "A: station " << problem.stations[problem.reference]
       << ". X_AS and its sigma along and about A's axes, mm and degrees:\n";
  for (std::size_t s = 0; s < problem.stations.size(); ++s) {
    if (s == problem.reference) continue;
    const Vector6 sigma = sigma_of(result.X_AS[s]);
    text << table_of(six_of(result.X_AS[s].X)) << "  " << problem.stations[s] << "\n"
         << table_of({sigma.data(), 6}) << "\n";
  }
  text << "points in A and their sigma, mm:\n";
  for (std::size_t i = 0; i < problem.points.size(); ++i) {
    const StationNetworkPoint& point = result.points[i];
    const Eigen::Vector3d sigma = point.covariance_mm2.diagonal().cwiseSqrt();
    if (point.known) text << table_of({point.p_A_mm.data(), 3}) << table_of({sigma.data(), 3});
    text << "  " << problem.points[i] << (point.known ? "\n" : ": its stations contradict each other\n");
  }
  text << "beside their place, axes of A, mm (" << number(result.rms_mm, 3) << " rms, redundancy "
       << result.redundancy << ", " << number(result.residual_ratio, 2) << " times the sigma):\n";
  for (std::size_t i = 0; i < problem.observations.size(); ++i) {
    const StationObservation& seen = problem.observations[i];
    const bool removed = is_in(result.removed, i);
    if (result.points[seen.point].stations < 2 && !removed) continue;
    text << table_of({result.residuals_A_mm[i].data(), 3}) << "  " << problem.points[seen.point] << " from "
         << problem.stations[seen.station] << (removed ? "  left out: it contradicts the others\n" : "\n");
  }
  return text.str();
}

void write_points(const Options& options, const Input& input, const StationNetworkResult& result) {
  std::vector<TablePoint> points;
  for (std::size_t i = 0; i < input.problem.points.size(); ++i)
    if (result.points[i].known)
      points.push_back({input.problem.points[i], input.roles[i], result.points[i].p_A_mm});
  replace_file(options.output, point_table(points, input.has_roles));
}

Answer orient(const Options& options) {
  if (!options.output.empty()) refuse_existing(options.output, options.replace);
  const Input input = load_input(options);
  const StationNetworkResult result = orient_stations(input.problem);
  const bool good = result.status == StationNetworkStatus::ok;
  if (good && !options.output.empty()) write_points(options, input, result);
  return {good ? done : no_answer, network_json(input.problem, result), network_text(input.problem, result)};
}

}  // namespace

void add_network(cli::Verb app, int& exit_status) {
  auto options = std::make_shared<Options>();
  const Verb verb = app.add_subcommand("network", "Stations of a moved measuring system in one frame");
  verb.add_option("--points", options->points, "CSV: station point x_mm y_mm z_mm [sigma_mm role]")
      .required();
  verb.add_option("--sigma-mm", options->sigma_mm,
                  "of one measured coordinate; without it from the residuals")
      .range(1e-6, 100.0);
  verb.add_option("--reference", options->reference, "the station whose frame is A (the first one)");
  verb.add_option("--output", options->output, "writes the points in A: point [role] x_mm y_mm z_mm");
  verb.add_flag("--replace", options->replace, "overwrite it");
  verb.add_flag(
      "--json", options->json,
      "one JSON object on stdout: status, reason, what, reference, sigma_mm, residual_ratio, rms_mm,\n"
      "redundancy, stations [{station, X_AS, X_SA, sigma, covariance, common_points}], points\n"
      "[{point, p_A, sigma, covariance, stations}], observations [{station, point, residual_mm,\n"
      "removed, suspect}]");
  verb.footer(network_help);
  verb.callback(
      [options, &exit_status] { exit_status = run([&] { return orient(*options); }, options->json); });
}

}  // namespace zeropose
