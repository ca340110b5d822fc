#include "daemon/cli/teach.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <optional>

#include "config/cameras.h"
#include "config/sensor_tables.h"
#include "config/text.h"
#include "daemon/cli/answer.h"
#include "daemon/cli/convert.h"
#include "measure/teaching.h"

namespace zeropose {
namespace {

using namespace cli;

constexpr const char* help =
    R"(The robot brings the sensor before one mark after the other (zeropose calibrate survey --target disc --camera
left,right); a mark may be seen from several positions. The object's frame O is that of the sensor at the first
position, or a given one (--frame). Each mark is the mean of its places, weighted with their covariances; a mark whose
places are further apart than these and --position-sigma-mm (what the robot does not repeat and the sensor's place in
the hand add) allow is named, and nothing is taught.
--cameras is the cell's calibration file (each camera with X_HC; the sensor's frame is then the hand's, or with --sensor,
X_HS, its own), or what calibrate views wrote (X_SC under the key X_WC), which needs --sensor.
Without --X-WR the world is the robot's base. The marks' places and X_WO go into the cell file (position_mm,
nominal_pose), each with the names of the positions that see it.
Example:
  zeropose teach --cameras window-pane.calibration.json --robot robot.csv --observations points.csv --json
Exit status: 0 done, 1 the pictures cannot give an answer (status and reason say why), 2 wrong usage or unreadable
input.)";

struct Options {
  std::string cameras, robot, observations;
  std::optional<std::string> sensor, frame, X_WR;
  double position_sigma_mm = 0.1, system_sigma_px = 0.1;
  bool json = false;
};

struct Taught {
  NamedSightings input;
  std::vector<std::string> views;  // by position of the problem
  TeachingResult result;
};

// The cameras in the sensor's frame.
std::vector<CalibratedCamera> in_sensor(const Options& options, const Pose& X_HS) {
  std::vector<CalibratedCamera> cameras = load_cameras(options.cameras);
  for (CalibratedCamera& camera : cameras) {
    if (camera.on_hand)
      camera.X_WC = X_HS.inverse() * camera.X_WC;
    else if (!options.sensor)
      throw ConfigError(
          {concat({options.cameras, ": ", camera.name,
                   ": found X_WC, expected X_HC; a camera in its sensor's frame needs --sensor, "
                   "the sensor in the hand"})});
    camera.on_hand = false;
  }
  return cameras;
}

std::string failed_sighting(const Taught& taught, const SensorSighting& sighting,
                            const TriangulatedPoint& place) {
  return concat(
      {"view ", sighting.view, ", point ", taught.input.points[sighting.point], ": ", place.reason});
}

// Triangulates every sighting. The first one without a place ends it.
Taught taught_of(const Options& options) {
  Taught taught;
  const Pose X_HS = pose_of_option(options.sensor, "--sensor").value_or(Pose::Identity());
  const Pose X_WR = pose_of_option(options.X_WR, "--X-WR").value_or(Pose::Identity());
  const auto cameras = in_sensor(options, X_HS);
  const NamedPoses hand = load_named_poses(options.robot);
  taught.input = load_sightings(options.observations, cameras, hand);
  std::vector<Pose> X_WS;
  for (const auto& [view, X_RH] : hand) {
    taught.views.push_back(view);
    X_WS.push_back(X_WR * X_RH * X_HS);
  }
  std::vector<SensedMark> sensed;
  for (const SensorSighting& sighting : taught.input.sightings) {
    const TriangulatedPoint place = triangulate({cameras, sighting.observations, options.system_sigma_px});
    if (place.code != Code::ok) {
      taught.result.code = place.code;
      taught.result.reason = failed_sighting(taught, sighting, place);
      return taught;
    }
    const auto view = std::ranges::find(taught.views, sighting.view);
    sensed.push_back({taught.input.points[sighting.point],
                      static_cast<std::size_t>(view - taught.views.begin()), place.p_W_mm,
                      place.covariance_mm2});
  }
  taught.result = teach({X_WS, sensed, pose_of_option(options.frame, "--frame"), options.position_sigma_mm});
  return taught;
}

// From where a mark was seen.
Json views_of(const Taught& taught, const std::string& mark) {
  Json views = Json::array();
  for (const SensorSighting& sighting : taught.input.sightings)
    if (taught.input.points[sighting.point] == mark) views.push_back(sighting.view);
  return views;
}

Answer teach_marks(const Options& options) {
  const Taught taught = taught_of(options);
  const TeachingResult& result = taught.result;
  const bool good = result.code == Code::ok;
  Answer answer;
  answer.exit_status = good ? done : no_answer;
  answer.json = {{"status", good ? "ok" : "failed"},
                 {"code", static_cast<int>(result.code)},
                 {"reason", result.reason},
                 {"X_WO", good ? Json(six_of(result.X_WO)) : Json()},
                 {"marks", Json::array()}};
  if (!good) {
    answer.text = concat(
        {"no answer: code ", std::to_string(static_cast<int>(result.code)), ": ", result.reason, "\n"});
    return answer;
  }
  answer.text = concat({"X_WO, mm and degrees:\n", table_of(six_of(result.X_WO)),
                        "\nmarks: x y z, sigma of x y z, largest distance of a place from the mean, mm:\n"});
  for (const TaughtMark& mark : result.marks) {
    const Eigen::Vector3d sigma = mark.covariance_mm2.diagonal().cwiseSqrt();
    answer.json["marks"].push_back({{"name", mark.mark},
                                    {"position_mm", json_of(mark.p_O_mm)},
                                    {"sigma_mm", json_of(sigma)},
                                    {"spread_mm", mark.spread_mm},
                                    {"views", views_of(taught, mark.mark)}});
    answer.text += concat({table_of({mark.p_O_mm.data(), 3}), table_of({sigma.data(), 3}),
                           table_of({&mark.spread_mm, 1}), "  ", mark.mark, "\n"});
  }
  return answer;
}

}  // namespace

void add_teach(cli::Verb app, int& exit_status) {
  auto options = std::make_shared<Options>();
  const Verb verb = app.add_subcommand("teach", "The marks of a new object, by a stereo sensor on a hand");
  verb.add_option("--cameras", options->cameras, "JSON {\"name\": camera, ...} of the sensor's cameras")
      .required();
  verb.add_option("--robot", options->robot, "CSV: view x_mm y_mm z_mm rx_deg ry_deg rz_deg, X_RH")
      .required();
  verb.add_option("--observations", options->observations, "CSV: view camera point u_px v_px [suu svv suv]")
      .required();
  verb.add_option("--sensor", options->sensor, "x,y,z,rx,ry,rz: X_HS, the sensor in the hand");
  verb.add_option("--frame", options->frame, "x,y,z,rx,ry,rz: X_WO, the object's frame");
  verb.add_option("--X-WR", options->X_WR, "x,y,z,rx,ry,rz: the robot's base in the world");
  verb.add_option("--position-sigma-mm", options->position_sigma_mm, "of the sensor's place at a mark (0.1)")
      .range(0.0, 100.0);
  verb.add_option("--system-sigma-px", options->system_sigma_px, "calibration errors in every pixel (0.1)")
      .range(0.0, 100.0);
  verb.add_flag(
      "--json", options->json,
      "one JSON object on stdout: status, code, reason, X_WO, marks [{name, position_mm, sigma_mm,\n"
      "spread_mm, views}]");
  verb.footer(help);
  verb.callback(
      [options, &exit_status] { exit_status = run([&] { return teach_marks(*options); }, options->json); });
}

}  // namespace zeropose
