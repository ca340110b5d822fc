// The stereo sensor of the window-pane cell, live, with nothing but the commands of the guide: its cameras by
// a glass board, its place in the hand by a known point, the opening taught, cars and panes measured (spec
// 40, 50 M2, 70).
#include "config/cell.h"
#include "tests/daemon/site.h"

namespace zeropose {
namespace {

using namespace std::chrono_literals;
using Json = nlohmann::json;

Eigen::Vector3d vector(const Json& three) {
  const auto numbers = three.get<std::array<double, 3>>();
  return {numbers[0], numbers[1], numbers[2]};
}

class WindowPaneChain : public testing::Test {
 protected:
  void survey(const std::string& program, int positions, std::vector<std::string> more) {
    more.insert(more.end(), {"--positions", std::to_string(positions)});
    site.survey(program, "left,right", more);
    for (const std::string& table : {std::string("robot"), std::string("points")})
      std::filesystem::rename(site.file("left,right-" + table + ".csv"),
                              site.file(program + "-" + table + ".csv"));
  }
  void activate_both(const std::string& file) {
    for (const std::string& camera : {std::string("left"), std::string("right")}) site.activate(camera, file);
  }

  const Site site{"window-pane"};
};

TEST_F(WindowPaneChain, FromTheGlassBoardToThePaneInItsOpening) {
  // Both cameras, in the frame of the left one.
  survey("board", 13,
         {"--target", "asymmetric-circles", "--rows", "5", "--cols", "5", "--pitch-mm", "14", "--diameter-mm",
          "10"});
  const Json sensor = site.calibrated(
      {"views", "--points", site.file("board-points.csv"), "--width", "768", "--height", "572"},
      "sensor.json");
  for (const std::string& camera : {std::string("left"), std::string("right")})
    expect_near(sensor["cameras"][camera], sensor["sigma"][camera], site.truth_of(camera).model);

  // Where the sensor sits in the hand.
  survey("ball", 10, {"--target", "ball", "--bright", "--min-diameter-px", "10", "--max-diameter-px", "80"});
  std::ofstream(site.file("known.csv")) << "point,x_mm,y_mm,z_mm\nball,600,700,650\n";
  const Json hand = site.calibrated(
      {"sensor", "--cameras", site.file("sensor.json"), "--points", site.file("known.csv"), "--observations",
       site.file("ball-points.csv"), "--robot", site.file("ball-robot.csv"), "--sigma-mm", "0.5"},
      "hand.json");
  // S is the left camera's frame.
  const Pose X_HS = site.truth_of("left").X_WC;
  const SixNumbers six = to_six_numbers(X_HS);
  const std::array<double, 6> truth{six.x_mm, six.y_mm, six.z_mm, six.rx_deg, six.ry_deg, six.rz_deg};
  for (std::size_t i = 0; i < 6; ++i)
    EXPECT_NEAR(hand["X_HS"][i].get<double>(), truth[i], 4.5 * hand["sigma"][i].get<double>()) << i;
  activate_both("hand.json");

  // The opening, hole by hole; its frame is the sensor's at the first one, so that only distances compare.
  survey("teach", 6, {"--target", "disc", "--min-diameter-px", "15", "--max-diameter-px", "60"});
  const Finished taught = site.zeropose({"teach", "--cameras", site.file("window-pane.calibration.json"),
                                         "--robot", site.file("teach-robot.csv"), "--observations",
                                         site.file("teach-points.csv"), "--json"});
  ASSERT_EQ(taught.status, 0) << taught.out << taught.err;
  const Json marks = Json::parse(taught.out)["marks"];
  const Cell cell = load_cell(site.cell());
  ASSERT_EQ(marks.size(), 6u);
  // The robot is off by 0.5 mm and 0.02 degrees from place to place, which is 0.2 mm at the sensor's arm.
  constexpr double place_sigma_mm = 0.6;
  for (std::size_t i = 0; i < 6; ++i)
    for (std::size_t j = 0; j < i; ++j) {
      const auto& drawn = cell.jobs[0].marks;
      EXPECT_NEAR((vector(marks[i]["position_mm"]) - vector(marks[j]["position_mm"])).norm(),
                  (drawn[i].p_O_mm - drawn[j].p_O_mm).norm(), 4.5 * std::sqrt(2) * place_sigma_mm);
    }

  // Cars and panes.
  const auto parts = site.simulated({"--drive", "--cars", "4"});
  const auto running = site.daemon();
  site.ask({"status", "--wait", "30"});
  EXPECT_EQ(parts->wait(100s), 0) << text_of_file(site.file("cell.log"));
}

}  // namespace
}  // namespace zeropose
