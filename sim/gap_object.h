// A window opening in a car and the pane that a robot's hand carries before it: what is true about them.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "calib/camera_model.h"
#include "config/cell.h"
#include "sim/coverage.h"

namespace zeropose {

// A rectangle with round corners about the origin.
struct RoundedBox {
  Eigen::Vector2d half_mm = Eigen::Vector2d::Zero();
  double corner_mm = 0;
};

class RoundedBoxOutline final : public FlatOutline {
 public:
  enum class Side { inside, outside };  // of the box: what the outline encloses
  explicit RoundedBoxOutline(const RoundedBox& box, Side side = Side::inside) : box_(box), side_(side) {}
  Edge edge_at(const Eigen::Vector2d& q_mm) const override;

 private:
  RoundedBox box_;
  Side side_;
};

// A place on the rim of the pane, in its frame T.
struct RimPlace {
  std::string name;        // of the job's gap
  std::size_t camera = 0;  // of the cell, that looks at it
  Eigen::Vector2d p_T_mm = Eigen::Vector2d::Zero();
  Eigen::Vector2d outward_T = Eigen::Vector2d::UnitX();
};

// The opening lies in z = 0 of O, the pane in z = 0 of T. O is where the car stops ideally: there T is O.
struct GapsObject {
  RoundedBox opening, pane;
  double pane_grey = 105;
  Pose X_RH = Pose::Identity();  // where the hand stands before its first motion
  Pose X_HT = Pose::Identity();  // how the pane truly sits in the hand
  // From the cell: who carries the pane, and where the cameras look.
  std::size_t robot = 0;
  Pose X_WR = Pose::Identity();
  std::vector<RimPlace> places{};
};

// Fills in what the cell says; X_HC of the true cameras. Throws ConfigError for a job without gaps, or a
// camera that does not look at the pane.
void complete(GapsObject& object, const Cell& cell, const Job& job,
              std::span<const CalibratedCamera> cameras);

// The distance from a place of the rim to the edge of the opening, along the car's surface; negative: the
// pane lies over the frame.
double true_gap_mm(const GapsObject& object, const RimPlace& place, const Pose& X_OT);

// Half of the difference between the widest and the narrowest.
double true_unevenness_mm(const GapsObject& object, const Pose& X_OT);

// What may lie over an edge near a place: NAME KIND or NAME KIND NUMBER, where the number draws it.
//   dirt    dark blobs on the frame's edge
//   glint   bright ones on the pane's edge
//   hidden  a round thing before the frame's edge
//   taped   a straight tape over the frame's edge: its own edge looks like the frame's
struct GapSpot {
  std::size_t place = 0;  // index
  std::string kind;
  std::uint64_t number = 0;
};
// nullopt: no such place or kind.
std::optional<GapSpot> gap_spot(const GapsObject& object, const std::string& text);

}  // namespace zeropose
