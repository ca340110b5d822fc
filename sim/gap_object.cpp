#include "sim/gap_object.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <sstream>

#include "config/config_error.h"
#include "sim/plane_view.h"

namespace zeropose {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

RimPlace rim_place(const GapsObject& object, const GapView& gap, const CalibratedCamera& camera) {
  const auto seen = PlaneView(camera.model, camera.X_WC.inverse() * object.X_HT).meet(gap.search.centre_px);
  if (!seen) throw ConfigError({"camera " + camera.name + " does not look at the pane"});
  const FlatOutline::Edge edge = RoundedBoxOutline(object.pane).edge_at(*seen);
  return {gap.name, gap.camera, *seen - edge.distance_mm * edge.normal, edge.normal};
}

}  // namespace

FlatOutline::Edge RoundedBoxOutline::edge_at(const Vector2d& q_mm) const {
  const Vector2d sign(q_mm.x() < 0 ? -1 : 1, q_mm.y() < 0 ? -1 : 1);
  // From the middle of the round corner.
  const Vector2d d = q_mm.cwiseAbs() - (box_.half_mm - Vector2d::Constant(box_.corner_mm));
  Edge edge;
  if (d.minCoeff() > 0)
    edge = {d.norm() - box_.corner_mm, sign.cwiseProduct(d.normalized())};
  else if (d.x() > d.y())
    edge = {d.x() - box_.corner_mm, {sign.x(), 0}};
  else
    edge = {d.y() - box_.corner_mm, {0, sign.y()}};
  return side_ == Side::inside ? edge : Edge{-edge.distance_mm, -edge.normal};
}

void complete(GapsObject& object, const Cell& cell, const Job& job,
              std::span<const CalibratedCamera> cameras) {
  if (!job.gaps) throw ConfigError({"job " + job.name + " has no gaps, its truth file shows some"});
  for (const GapView& gap : job.gaps->gaps)
    object.places.push_back(rim_place(object, gap, cameras[gap.camera]));
  object.robot = cell.hand_of.at(job.gaps->gaps.front().camera).value();
  object.X_WR = cell.robots.at(object.robot).X_WR;
}

double true_gap_mm(const GapsObject& object, const RimPlace& place, const Pose& X_OT) {
  const Vector3d p_O_mm = X_OT * Vector3d(place.p_T_mm.x(), place.p_T_mm.y(), 0);
  return -RoundedBoxOutline(object.opening).edge_at(p_O_mm.head<2>()).distance_mm;
}

double true_unevenness_mm(const GapsObject& object, const Pose& X_OT) {
  double low = INFINITY, high = -INFINITY;
  for (const RimPlace& place : object.places) {
    const double gap_mm = true_gap_mm(object, place, X_OT);
    low = std::min(low, gap_mm);
    high = std::max(high, gap_mm);
  }
  return (high - low) / 2;
}

std::optional<GapSpot> gap_spot(const GapsObject& object, const std::string& text) {
  constexpr std::array kinds{"dirt", "glint", "hidden", "taped"};
  for (std::size_t i = 0; i < object.places.size(); ++i) {
    const std::string start = object.places[i].name + " ";
    if (!text.starts_with(start)) continue;
    GapSpot spot{i, {}, 0};
    std::istringstream rest(text.substr(start.size()));
    rest >> spot.kind;
    if (!rest.eof()) rest >> spot.number;
    if (!rest.fail() && rest.eof() && std::ranges::find(kinds, spot.kind) != kinds.end()) return spot;
  }
  return std::nullopt;
}

}  // namespace zeropose
