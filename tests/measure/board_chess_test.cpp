// Chessboards in rendered pictures (spec 40 P1).
#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>
#include <numbers>

#include "measure/board.h"
#include "tests/support/board_picture.h"

namespace zeropose {
namespace {

using Eigen::Vector2d;
using test::board_pose;
using test::BoardScene;
using test::expose;
using test::paint;

constexpr double degree = std::numbers::pi / 180;

BoardScene chess(int rows, int cols) {
  BoardScene scene;
  scene.kind = BoardKind::chessboard;
  scene.camera = {640, 480, 900, 900, 320, 240, Division{-0.1}};
  scene.rows = rows;
  scene.cols = cols;
  scene.pitch_mm = 12;
  scene.margin_mm = 24;
  return scene;
}

BoardResult find(const BoardScene& scene, unsigned seed = 1) {
  std::mt19937_64 random(seed);
  return find_board(expose(paint(scene), 2, random).view(), scene.problem());
}

// Errors as the covariances promise: N points have 2 N errors, their mean square is known to 1 / sqrt(N);
// four of these and a tenth for what the model leaves.
void expect_corners(const BoardScene& scene, const BoardResult& result) {
  ASSERT_EQ(result.status, BoardStatus::found) << result.reason;
  ASSERT_EQ(result.points.size(), std::size_t(scene.rows * scene.cols));
  double chi2 = 0, sigma = 0;
  for (const BoardPoint& point : result.points) {
    const Vector2d error = point.u_px - scene.seen_px(point.at);
    chi2 += error.dot(point.covariance_px2.inverse() * error) / 2;
    sigma += std::sqrt(point.covariance_px2.trace() / 2);
    EXPECT_LT(error.norm(), 0.08);
    EXPECT_EQ(point.p_B_mm, scene.p_B_mm(point.at));
  }
  const auto n = double(result.points.size());
  EXPECT_LT(chi2 / n, 1.1 + 4 / std::sqrt(n));
  EXPECT_GT(chi2 / n, 0.9 - 4 / std::sqrt(n));
  EXPECT_LT(sigma / n, 0.02);
}

// Rows and columns of different parity: the corner squares differ in colour, the first one is the dark one,
// whatever the board's turn. The picture's maker paints it beyond (0, 0).
TEST(Chessboard, SixByNineHasOneReading) {
  for (int k = 0; k < 3; ++k) {
    BoardScene scene = chess(6, 9);
    scene.X_CB = board_pose(scene, 300, 30 * degree, 0.5, 0.1 + 2.3 * k);
    const BoardResult result = find(scene);
    expect_corners(scene, result);
    EXPECT_EQ(result.equivalent_readings, 1);
  }
}

// Both odd: half a turn changes nothing, the corner at the top left decides.
TEST(Chessboard, SevenByNineTiltedAndTurned) {
  BoardScene scene = chess(7, 9);
  scene.X_CB = board_pose(scene, 300, 45 * degree, 2.0, 0.2);
  BoardResult result = find(scene);
  expect_corners(scene, result);
  EXPECT_EQ(result.equivalent_readings, 2);
  EXPECT_LT(result.points.front().u_px.norm(), result.points.back().u_px.norm());
  scene.X_CB = board_pose(scene, 300, 45 * degree, 2.0, 0.2 + 180 * degree);
  result = find(scene);
  ASSERT_EQ(result.status, BoardStatus::found);
  EXPECT_LT((result.points.back().u_px - scene.seen_px({0, 0})).norm(), 0.08);
}

TEST(Chessboard, WrongSizeIsNotFound) {
  BoardScene scene = chess(6, 9);
  scene.X_CB = board_pose(scene, 300, 0, 0, 0.1);
  std::mt19937_64 random(1);
  const auto pixels = expose(paint(scene), 2, random);
  BoardProblem problem = scene.problem();
  problem.rows = 8;
  const BoardResult result = find_board(pixels.view(), problem);
  EXPECT_EQ(result.status, BoardStatus::no_grid);
  EXPECT_NE(result.reason.find("8 x 9 inner corners"), std::string::npos) << result.reason;
}

// The true row and column of the nearest corner.
Eigen::Vector2i true_index(const BoardScene& scene, const Vector2d& u_px) {
  Eigen::Vector2i best(0, 0);
  double nearest = 1e9;
  for (int row = 0; row < scene.rows; ++row)
    for (int col = 0; col < scene.cols; ++col) {
      const double distance = (scene.seen_px({row, col}) - u_px).norm();
      if (distance < nearest) nearest = distance, best = {row, col};
    }
  EXPECT_LT(nearest, 0.08);
  return best;
}

TEST(Chessboard, PartlyCoveredIsFoundInPartWhenThatIsAllowed) {
  BoardScene scene = chess(7, 10);
  scene.X_CB = board_pose(scene, 320, 35 * degree, 0.7, 0.2);
  const double edge = scene.seen_px({3, 7}).x();
  scene.covers.push_back({{{edge, -1}, {641, -1}, {641, 481}, {edge, 481}}, 90});
  EXPECT_NE(find(scene).status, BoardStatus::found);
  std::mt19937_64 random(1);
  BoardProblem problem = scene.problem();
  problem.partial = true;
  const BoardResult result = find_board(expose(paint(scene), 2, random).view(), problem);
  ASSERT_EQ(result.status, BoardStatus::found) << result.reason;
  EXPECT_FALSE(result.place_known);
  EXPECT_GE(result.points.size(), 7u * 5u);
  // One shift and one turn by quarters carries all indices into the true ones, without a mirror.
  const auto at = [&](std::size_t i) {
    return Eigen::Vector2i(result.points[i].at.row, result.points[i].at.col);
  };
  const Eigen::Vector2i origin = true_index(scene, result.points[0].u_px);
  ASSERT_EQ(at(1), Eigen::Vector2i(0, 1));
  const Eigen::Vector2i by_col = true_index(scene, result.points[1].u_px) - origin;
  const Eigen::Vector2i by_row(by_col.y(), -by_col.x());
  EXPECT_EQ(by_col.squaredNorm(), 1);
  for (std::size_t i = 0; i < result.points.size(); ++i)
    EXPECT_EQ(true_index(scene, result.points[i].u_px), origin + at(i).x() * by_row + at(i).y() * by_col)
        << i;
}

}  // namespace
}  // namespace zeropose
