#include "daemon/cli/triangulate.h"

#include <memory>
#include <sstream>

#include "config/cameras.h"
#include "config/tables.h"
#include "config/text.h"
#include "daemon/cli/answer.h"
#include "daemon/cli/verb.h"
#include "measure/triangulation.h"

namespace zeropose {
namespace {

using namespace cli;

constexpr const char* help =
    R"(A point needs two cameras and more. p_W is in the frame in which the cameras' poses are given: the world, or that of
a stereo sensor; covariance is that of p_W in mm^2, along the axes of that frame. ray_gap_mm is the shortest
distance between the two rays; with more than two cameras the root mean square distance of the point from the rays.
suu svv suv is the covariance of the found pixel in px^2; where it is not given it is that of one pixel (1 1 0):
the covariance and the test for contradicting cameras then speak of one pixel.
A point without a place has p_W null, and code and reason say why: one camera only, rays that are parallel within
their noise, rays that meet behind a camera, cameras that contradict each other.
Example:
  zeropose triangulate --cameras stereo.json --observations found.csv --json
with stereo.json
  {"left": {"model": "division", "width": 768, "height": 572, "fx": 2000, "fy": 2000, "cx": 384, "cy": 286,
            "K": 0, "X_WC": [0, 0, 0, 0, 10, 0]},
   "right": {..., "X_WC": [300, 0, 0, 0, -10, 0]}}
found.csv
  camera, point, u_px, v_px
  left, hole, 401.25, 288.5
  right, hole, 371.5, 288.75
Exit status: 0 done, 1 a point has no place (with the reason; the others are given), 2 wrong usage or unreadable input.)";

struct TriangulateOptions {
  std::string cameras, observations;
  bool json = false;
};

struct NamedPoint {
  std::string name;
  std::vector<Observation> observations;
  TriangulatedPoint place;
};

std::vector<NamedPoint> places_of(const std::vector<CalibratedCamera>& cameras,
                                  const PointObservations& input) {
  std::vector<NamedPoint> points;
  for (const std::string& name : input.points) points.push_back({name, {}, {}});
  for (const Observation& observation : input.observations)
    points[observation.mark].observations.push_back(observation);
  for (NamedPoint& point : points) point.place = triangulate({cameras, point.observations});
  return points;
}

Json covariance_json(const Eigen::Matrix3d& covariance) {
  Json rows = Json::array();
  for (int row = 0; row < 3; ++row) rows.push_back(json_of(Eigen::Vector3d(covariance.row(row))));
  return rows;
}

Json point_json(const std::vector<CalibratedCamera>& cameras, const NamedPoint& point) {
  const TriangulatedPoint& place = point.place;
  const bool good = place.code == Code::ok, tried = !place.deviations_px.empty();
  Json json = {{"point", point.name},
               {"code", static_cast<int>(place.code)},
               {"reason", place.reason},
               // No number that could be taken for a place unless it is one.
               {"p_W", good ? json_of(place.p_W_mm) : Json()},
               {"covariance", good ? covariance_json(place.covariance_mm2) : Json()},
               {"ray_gap_mm", tried ? Json(place.ray_gap_mm) : Json()},
               {"deviations", Json::array()}};
  for (std::size_t i = 0; i < place.deviations_px.size(); ++i)
    json["deviations"].push_back({{"camera", cameras[point.observations[i].camera].name},
                                  {"dev_px", json_of(place.deviations_px[i])}});
  return json;
}

std::string point_text(const NamedPoint& point) {
  const TriangulatedPoint& place = point.place;
  if (place.code != Code::ok)
    return concat({"no place: code ", std::to_string(static_cast<int>(place.code)), " ",
                   text_of(place.code).name, ": ", place.reason, "  ", point.name, "\n"});
  const Eigen::Vector3d sigma = place.covariance_mm2.diagonal().cwiseSqrt();
  return concat({table_of({place.p_W_mm.data(), 3}), table_of({sigma.data(), 3}),
                 table_of({&place.ray_gap_mm, 1}), "  ", point.name, "\n"});
}

Answer places(const TriangulateOptions& options) {
  const std::vector<CalibratedCamera> cameras = load_cameras(options.cameras);
  const std::vector<NamedPoint> points =
      places_of(cameras, load_point_observations(options.observations, cameras));
  if (points.empty()) return failure("no point was observed");
  Answer answer;
  answer.json = {{"status", "ok"}, {"reason", ""}, {"points", Json::array()}};
  answer.text = "x y z, sigma of x y z, distance of the rays, mm:\n";
  for (const NamedPoint& point : points) {
    answer.json["points"].push_back(point_json(cameras, point));
    answer.text += point_text(point);
    if (point.place.code == Code::ok || answer.exit_status == no_answer) continue;
    answer.exit_status = no_answer;
    answer.json["status"] = "failed";
    answer.json["reason"] = concat({"point ", point.name, ": ", point.place.reason});
  }
  return answer;
}

}  // namespace

void add_triangulate(cli::Verb app, int& exit_status) {
  auto options = std::make_shared<TriangulateOptions>();
  const Verb verb = app.add_subcommand("triangulate", "The places of points that several cameras see");
  verb.add_option("--cameras", options->cameras,
                  "JSON {\"name\": camera, ...} with model, internals and X_WC")
      .required();
  verb.add_option("--observations", options->observations, "CSV: camera point u_px v_px [suu svv suv]")
      .required();
  verb.add_flag("--json", options->json,
                "one JSON object on stdout: status, reason, points [{point, code, reason, p_W [x, y, z] mm,\n"
                "covariance (3x3, mm^2), ray_gap_mm, deviations [{camera, dev_px}]}]");
  verb.footer(help);
  verb.callback(
      [options, &exit_status] { exit_status = run([&] { return places(*options); }, options->json); });
}

}  // namespace zeropose
