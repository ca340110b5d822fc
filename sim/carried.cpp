#include "sim/carried.h"

#include <Eigen/Geometry>
#include <algorithm>

#include "sim/ball_plate_look.h"

namespace zeropose {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double side_grey = 185, mark_grey = 55, behind_grey = 70;
constexpr double rim_share = 0.12, rim_mm = 5;  // of the side beyond its marks, of its size and besides
constexpr double same_normal = 1e-6;

// The marks of one normal. S: origin in their middle, z along the normal.
struct Side {
  Pose X_BS = Pose::Identity();
  Vector2d half_mm = Vector2d::Zero();
  std::vector<PrintedMark> marks;
};

std::vector<Side> sides_of(const CarriedBody& body) {
  std::vector<Side> sides;
  for (const PrintedMark& mark : body.marks) {
    const auto same = std::ranges::find_if(sides, [&](const Side& side) {
      return (side.X_BS.linear().col(2) - mark.normal_B).norm() < same_normal;
    });
    Side& side = same != sides.end() ? *same : sides.emplace_back();
    if (side.marks.empty())
      side.X_BS.linear() = Eigen::Quaterniond::FromTwoVectors(Vector3d::UnitZ(), mark.normal_B).matrix();
    side.marks.push_back(mark);
  }
  for (Side& side : sides) {
    const Eigen::Matrix3d R_SB = side.X_BS.linear().transpose();
    Eigen::AlignedBox3d box;
    for (const PrintedMark& mark : side.marks)
      for (const double reach_mm : {-mark.radius_mm, mark.radius_mm})
        box.extend(R_SB * mark.p_B_mm + Vector3d(reach_mm, reach_mm, 0));
    side.X_BS.translation() = side.X_BS.linear() * box.center();
    side.half_mm = (0.5 + rim_share) * box.sizes().head<2>() + Vector2d::Constant(rim_mm);
  }
  return sides;
}

void paint_side(Canvas& canvas, const Side& side, const Pose& X_CB) {
  const Pose X_CS = X_CB * side.X_BS;
  const bool seen = X_CS.linear().col(2).dot(X_CS.translation()) < 0;
  canvas.paint(
      {side.X_BS,
       {{rounded_box(Vector2d::Zero(), 0, side.half_mm, rim_mm), {.grey = seen ? side_grey : behind_grey}}}},
      X_CB);
  if (!seen) return;
  for (const PrintedMark& mark : side.marks) {
    Pose X_BM = side.X_BS;
    X_BM.translation() = mark.p_B_mm;
    canvas.fill(DiscOutline(mark.radius_mm), X_CB * X_BM, mark_grey);
  }
}

void paint(Canvas& canvas, const CarriedBall& ball, const Pose& X_CW) {
  paint_ball(canvas, X_CW * ball.p_W_mm, ball.radius_mm, ball.grey);
}

// The farthest side first.
void paint(Canvas& canvas, const CarriedBody& body, const Pose& X_CW) {
  const Pose X_CB = X_CW * body.X_WB;
  std::vector<Side> sides = sides_of(body);
  const auto distance = [&](const Side& side) { return (X_CB * side.X_BS.translation()).norm(); };
  std::ranges::sort(sides, std::ranges::greater(), distance);
  for (const Side& side : sides) paint_side(canvas, side, X_CB);
}

void paint(Canvas&, const CarriedPane&, const Pose&) {}

}  // namespace

std::vector<PrintedMark> printed_board(int rows, int cols, double pitch_mm, double diameter_mm) {
  std::vector<PrintedMark> marks;
  for (int row = 0; row < rows; ++row)
    for (int col = 0; col < cols; ++col)
      marks.push_back({pitch_mm * Vector3d(2 * col + row % 2, row, 0), diameter_mm / 2});
  return marks;
}

void paint_carried(Canvas& canvas, const Carried& carried, const Pose& X_CW) {
  std::visit([&](const auto& thing) { paint(canvas, thing, X_CW); }, carried);
}

}  // namespace zeropose
