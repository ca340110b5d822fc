// Where the unevenness of the pane-gaps cell comes from, without pictures: the tables of docs/cells.md. Edges
// are lines of the outlines, seen through the true cameras and carried back by hand with the believed ones.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdio>
#include <map>
#include <random>

#include "config/cell.h"
#include "measure/gap_evening.h"
#include "sim/scene.h"
#include "sim/wrong_calibration.h"

namespace zeropose {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

const std::string cells = std::string(ZEROPOSE_SOURCE_DIR) + "/config/cells/pane-gaps";

// What is wrong; one sigma each.
struct Wrong {
  const char* name;
  double edge_px = 0;  // of an edge, across it
  CalibrationErrors calibration{0, 0, 0, 0};
  double grip_mm = 0, grip_deg = 0;    // how the pane sits in the hand, all six numbers
  double height_mm = 0, tilt_deg = 0;  // of the car out of the plane: z, rx and ry
  double shape_mm = 0;                 // of the frame at each gap
  double gain = 0, repeat_mm = 0, repeat_deg = 0;
  bool across = false;  // cameras that look across the gap instead of along it
};

constexpr int most_motions = 10;

struct Outcome {  // of the cars that became even
  double squares = 0, worst_mm = 0;
  int count = 0, motions = 0;
  int cars = 0, given_up = 0;  // of all
};

struct Drawn;

class PaneBudget : public testing::Test {
 protected:
  PaneBudget() {
    for (const CalibratedCamera& camera : cameras_in_hand()) true_cameras.push_back(camera);
  }

  // X_HC of the true cameras: where the scene has them at the hand's first place.
  std::vector<CalibratedCamera> cameras_in_hand() const {
    std::vector<CalibratedCamera> cameras = scene.cameras;
    for (const HandCamera& hand : scene.hand_cameras) cameras[hand.camera].X_WC = hand.X_HC;
    return cameras;
  }

  Drawn drawn_car(const Wrong& wrong, int car, std::mt19937_64& random) const;
  Outcome run(const Wrong& wrong, int cars) const;

  const Cell cell = load_cell(cells + ".json");
  const Scene scene = load_scene(cell, cells + ".sim.json");
  const GapsObject object = std::get<GapsObject>(scene.object);
  std::vector<CalibratedCamera> true_cameras;
};

double normal(std::mt19937_64& random, double sigma) {
  return std::normal_distribution<double>(0, 1)(random) * sigma;
}

Pose drawn(std::mt19937_64& random, double mm, double deg) {
  Vector6 d;
  for (int i = 0; i < 6; ++i) d(i) = normal(random, i < 3 ? mm : deg / degrees_per_radian);
  return moved(Pose::Identity(), d);
}

// Where the line of sight of a pixel meets z = 0 of T, by lines and planes alone.
Vector2d on_pane(const CalibratedCamera& camera, const Pose& X_HT, const Vector2d& u_px) {
  const Pose X_TC = X_HT.inverse() * camera.X_WC;
  const Vector3d d = X_TC.linear() * ray(camera.model, u_px).value();
  const Vector3d p = X_TC.translation() - X_TC.translation().z() / d.z() * d;
  return p.head<2>();
}

// A camera that looks at the same place with its tilt about the gap's direction instead of across it.
CalibratedCamera across(CalibratedCamera camera, const Pose& X_HT, const RimPlace& place) {
  const Pose X_TC = X_HT.inverse() * camera.X_WC;
  const Vector3d middle(place.p_T_mm.x() + 3.5 * place.outward_T.x(),
                        place.p_T_mm.y() + 3.5 * place.outward_T.y(), 0);
  Pose turn = Pose::Identity();
  turn.linear() = exp_so3(M_PI / 2 * Vector3d::UnitZ());
  Pose X_TM = Pose::Identity();
  X_TM.translation() = middle;
  camera.X_WC = X_HT * X_TM * turn * X_TM.inverse() * X_TC;
  return camera;
}

struct Seen {
  std::vector<CalibratedCamera> cameras, believed;
  std::vector<double> shape_mm;  // of the frame at each place
};

// The gap as the believed camera has it: two points of each edge, 6 mm apart.
PaneGap seen_gap(const GapsObject& object, const GapTask& task, const Seen& seen, std::size_t i,
                 const Pose& X_OT, double edge_px, std::mt19937_64& random) {
  const RimPlace& place = object.places[i];
  const Vector2d along(-place.outward_T.y(), place.outward_T.x());
  const Pose X_TO = X_OT.inverse();
  const auto pixel = [&](const Vector3d& p_T) {
    return project(seen.cameras[i].model, seen.cameras[i].X_WC.inverse() * object.X_HT * p_T).value();
  };
  const Vector2d noise_pane(normal(random, edge_px), normal(random, edge_px)),
      noise_frame(normal(random, edge_px), normal(random, edge_px));
  std::array<Vector2d, 2> pane, frame;
  for (int k = 0; k < 2; ++k) {
    const Vector2d q = place.p_T_mm + (k == 0 ? -3 : 3) * along;
    pane[std::size_t(k)] = on_pane(seen.believed[i], task.X_HT, pixel({q.x(), q.y(), 0}) + noise_pane);
    // The frame's edge is a straight side of the opening; its point beside q.
    const Vector3d p_O = X_OT * Vector3d(q.x(), q.y(), 0);
    const FlatOutline::Edge edge = RoundedBoxOutline(object.opening).edge_at(p_O.head<2>());
    const Vector2d foot = p_O.head<2>() - (edge.distance_mm - seen.shape_mm[i]) * edge.normal;
    frame[std::size_t(k)] =
        on_pane(seen.believed[i], task.X_HT, pixel(X_TO * Vector3d(foot.x(), foot.y(), 0)) + noise_frame);
  }
  const Vector2d e = ((pane[1] - pane[0]).normalized() + (frame[1] - frame[0]).normalized()).normalized();
  Vector2d n(e.y(), -e.x());
  const Vector2d pane_middle = (pane[0] + pane[1]) / 2, frame_middle = (frame[0] + frame[1]) / 2;
  if (n.dot(frame_middle - pane_middle) < 0) n = -n;
  return {place.name, pane_middle, n, n.dot(frame_middle - pane_middle), std::max(1e-4, 0.1 * edge_px), 1, 0};
}

double truth_mm(const GapsObject& object, const Seen& seen, const Pose& X_OT) {
  double low = INFINITY, high = -INFINITY;
  for (std::size_t i = 0; i < object.places.size(); ++i) {
    const double gap = true_gap_mm(object, object.places[i], X_OT) + seen.shape_mm[i];
    low = std::min(low, gap), high = std::max(high, gap);
  }
  return (high - low) / 2;
}

// A car before the robot, and the robot.
struct Drawn {
  GapsObject object;
  Seen seen;
  Pose X_OT_meant = Pose::Identity(), X_OT = Pose::Identity();
  Eigen::Vector3d gain = Eigen::Vector3d::Ones();
};

Drawn PaneBudget::drawn_car(const Wrong& wrong, int car, std::mt19937_64& random) const {
  std::uniform_real_distribution<double> any(-1, 1);
  Drawn now{object, {}};
  now.object.X_HT = cell.jobs[0].gaps->X_HT * drawn(random, wrong.grip_mm, wrong.grip_deg);
  for (std::size_t i = 0; i < true_cameras.size(); ++i) {
    now.seen.cameras.push_back(wrong.across ? across(true_cameras[i], object.X_HT, object.places[i])
                                            : true_cameras[i]);
    now.seen.shape_mm.push_back(normal(random, wrong.shape_mm));
  }
  now.seen.believed =
      wrong_calibration(now.seen.cameras, wrong.calibration, static_cast<std::uint64_t>(car) / 10 + 1);
  now.X_OT_meant =
      from_six_numbers({2 * any(random), 2 * any(random), normal(random, wrong.height_mm),
                        normal(random, wrong.tilt_deg), normal(random, wrong.tilt_deg), 0.5 * any(random)});
  now.X_OT = now.X_OT_meant * drawn(random, wrong.repeat_mm, wrong.repeat_deg);
  for (double& g : now.gain) g = 1 + wrong.gain * any(random);
  return now;
}

// The robot moves the tool where it believes the pane to be.
void move(Drawn& now, const GapTask& task, const Pose& X_TTn, const Wrong& wrong, std::mt19937_64& random) {
  const SixNumbers s = to_six_numbers(X_TTn);
  const Pose X_TB = now.object.X_HT.inverse() * task.X_HT;
  now.X_OT_meant =
      now.X_OT_meant * X_TB *
      from_six_numbers({now.gain.x() * s.x_mm, now.gain.y() * s.y_mm, 0, 0, 0, now.gain.z() * s.rz_deg}) *
      X_TB.inverse();
  now.X_OT = now.X_OT_meant * drawn(random, wrong.repeat_mm, wrong.repeat_deg);
}

// How many motions until the answer is even. Without errors of the robot it goes on to a thousandth of a mm,
// so that only what the cameras do not see is left.
int evened(Drawn& now, const GapTask& task, const Wrong& wrong, std::mt19937_64& random) {
  constexpr int exact_motions = 4;  // what they leave no motion takes away
  const bool exact = wrong.gain == 0 && wrong.repeat_mm == 0;
  for (int motions = 0; motions < most_motions; ++motions) {
    std::vector<PaneGap> gaps;
    for (std::size_t i = 0; i < now.object.places.size(); ++i)
      gaps.push_back(seen_gap(now.object, task, now.seen, i, now.X_OT, wrong.edge_px, random));
    // The check against contradictions is not what is asked about here.
    const EveningResult result = even_gaps({gaps, true, 1, exact ? 0.001 : task.tolerance_mm, 20, 20, 0.1});
    EXPECT_EQ(result.code, Code::ok) << wrong.name << ": " << result.reason;
    if (result.even_already || (exact && motions == exact_motions)) return motions;
    move(now, task, result.X_TTn, wrong, random);
  }
  return most_motions;
}

Outcome PaneBudget::run(const Wrong& wrong, int cars) const {
  std::mt19937_64 random(7);
  Outcome outcome;
  for (int car = 0; car < cars; ++car) {
    Drawn now = drawn_car(wrong, car, random);
    const int motions = evened(now, *cell.jobs[0].gaps, wrong, random);
    outcome.cars += 1;
    outcome.given_up += motions == most_motions ? 1 : 0;
    if (motions == most_motions) continue;
    const double left_mm = truth_mm(now.object, now.seen, now.X_OT);
    outcome.squares += left_mm * left_mm;
    outcome.worst_mm = std::max(outcome.worst_mm, left_mm);
    outcome.count += 1;
    outcome.motions += motions;
  }
  return outcome;
}

TEST_F(PaneBudget, Table) {
  const CalibrationErrors as_in_practice;
  const CalibrationErrors position{0.5, 0, 0, 0}, rotation{0, 0.02, 0, 0}, focal{0, 0, 0.0005, 0},
      origin{0, 0, 0, 4.5};
  const Wrong rows[] = {
      {.name = "edges 0.02 px", .edge_px = 0.02},
      {.name = "edges 0.1 px", .edge_px = 0.1},
      {.name = "cameras in the hand 0.5 mm", .calibration = position},
      {.name = "cameras in the hand 0.02 degrees", .calibration = rotation},
      {.name = "focal lengths 0.05 %", .calibration = focal},
      {.name = "image origins 4.5 px", .calibration = origin},
      {.name = "calibration, all of it", .calibration = as_in_practice},
      {.name = "pane 0.4 mm off in the gripper", .grip_mm = 0.4},
      {.name = "pane 0.05 degrees off in the gripper", .grip_deg = 0.05},
      {.name = "car 0.5 mm out of the plane", .height_mm = 0.5},
      {.name = "car 0.05 degrees out of the plane", .tilt_deg = 0.05},
      {.name = "the same, cameras that look across the gap", .tilt_deg = 0.05, .across = true},
      {.name = "frame 0.03 mm off its drawing at each gap", .shape_mm = 0.03},
      {.name = "robot 10 % too much or too little", .gain = 0.1},
      {.name = "robot repeats to 0.05 mm by its data sheet", .repeat_mm = 0.015, .repeat_deg = 0.001},
      {.name = "robot 0.05 mm, 0.003 degrees, one sigma", .repeat_mm = 0.05, .repeat_deg = 0.003},
      {.name = "all of that, robot by its data sheet, but the shape",
       .edge_px = 0.02,
       .calibration = as_in_practice,
       .grip_mm = 0.4,
       .grip_deg = 0.05,
       .height_mm = 0.5,
       .tilt_deg = 0.05,
       .gain = 0.1,
       .repeat_mm = 0.015,
       .repeat_deg = 0.001},
  };
  std::printf("| what is wrong | RMS mm | worst mm | motions | not even after 10 |\n|---|---|---|---|---|\n");
  std::map<std::string, double> rms, worst;
  for (const Wrong& row : rows) {
    const Outcome o = run(row, 400);
    rms[row.name] = std::sqrt(o.squares / o.count);
    worst[row.name] = o.worst_mm;
    std::printf("| %s | %.3f | %.3f |", row.name, rms[row.name], o.worst_mm);
    if (row.gain > 0 || row.repeat_mm > 0)
      std::printf(" %.1f | %.1f %% |\n", double(o.motions) / o.count, 100.0 * o.given_up / o.cars);
    else
      std::printf(" | |\n");
  }
  // Each law is one that the page draws a conclusion from.
  EXPECT_LT(rms["edges 0.02 px"], 0.005);
  EXPECT_LT(rms["calibration, all of it"], 0.03);
  EXPECT_GT(rms["the same, cameras that look across the gap"], 5 * rms["car 0.05 degrees out of the plane"]);
  EXPECT_LT(worst["all of that, robot by its data sheet, but the shape"], 0.1);
}

}  // namespace
}  // namespace zeropose
