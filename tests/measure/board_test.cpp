// Boards of circles in rendered pictures: indexing, accuracy, hidden parts, clutter, refusals (spec 40 P1).
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
using test::Pixels;

constexpr double degree = std::numbers::pi / 180;
constexpr double noise = 2;  // grey levels

Pixels picture_of(const BoardScene& scene, unsigned seed = 1, double sigma = noise) {
  std::mt19937_64 random(seed);
  return expose(paint(scene), sigma, random);
}

BoardScene frontal() {
  BoardScene scene;
  scene.X_CB = board_pose(scene, 320, 0, 0, 0);
  return scene;
}

struct Errors {
  double rms_px = 0, worst_px = 0;
  double rms_expected_px = 0;  // as the covariances say
  double chi2 = 0;             // mean of the squared errors by their covariance, per coordinate: 1
};

// Points against the truth, the points' own row and column believed.
Errors errors_of(const BoardScene& scene, const BoardResult& result) {
  Errors errors;
  for (const BoardPoint& point : result.points) {
    const Vector2d error = point.u_px - scene.seen_px(point.at);
    errors.rms_px += error.squaredNorm() / 2;
    errors.rms_expected_px += point.covariance_px2.trace() / 2;
    errors.chi2 += error.dot(point.covariance_px2.inverse() * error) / 2;
    errors.worst_px = std::max(errors.worst_px, error.norm());
    EXPECT_EQ(point.p_B_mm, scene.p_B_mm(point.at));
  }
  const auto n = double(result.points.size());
  errors.rms_px = std::sqrt(errors.rms_px / n);
  errors.rms_expected_px = std::sqrt(errors.rms_expected_px / n);
  errors.chi2 /= n;
  return errors;
}

// Every point of the board at its place, with errors like those the covariances promise. N points have 2 N
// errors: their mean square is known to 1 / sqrt(N); four of these, and a tenth for what the model of an edge
// leaves.
void expect_whole_board(const BoardScene& scene, const BoardResult& result) {
  ASSERT_EQ(result.status, BoardStatus::found) << result.reason;
  EXPECT_EQ(result.reason, "");
  EXPECT_TRUE(result.missing.empty());
  EXPECT_TRUE(result.place_known);
  ASSERT_EQ(result.points.size(), std::size_t(scene.rows * scene.cols));
  const Errors errors = errors_of(scene, result);
  const double room = 4 / std::sqrt(double(result.points.size()));
  EXPECT_LT(errors.chi2, 1.1 + room);
  EXPECT_GT(errors.chi2, 0.9 - room);
  EXPECT_LT(errors.worst_px, 6 * errors.rms_expected_px + 0.01);
  testing::Test::RecordProperty("rms_px", std::to_string(errors.rms_px));
}

// The same board read by a half or quarter turn: the scene whose first point is where the result's is.
BoardScene read_from(const BoardScene& scene, const BoardResult& result) {
  BoardScene best = scene;
  double nearest = 1e9;
  for (int quarter = 0; quarter < 4; ++quarter) {
    if (scene.kind == BoardKind::asymmetric_circles && quarter % 2 != 0) continue;
    BoardScene turned = scene;
    if (quarter % 2 != 0) std::swap(turned.rows, turned.cols);
    if (turned.rows != scene.rows) continue;
    const Eigen::Vector3d middle =
        0.5 * (scene.p_B_mm({0, 0}) + scene.p_B_mm({scene.rows - 1, scene.cols - 1}));
    Pose X_BT = Pose::Identity();
    X_BT.linear() = Eigen::AngleAxisd(90 * degree * quarter, Eigen::Vector3d::UnitZ()).matrix();
    X_BT.translation() = middle - X_BT.linear() * middle;
    turned.X_CB = scene.X_CB * X_BT;
    const double distance = (turned.seen_px({0, 0}) - result.points.front().u_px).norm();
    if (distance < nearest) nearest = distance, best = turned;
  }
  return best;
}

TEST(Board, FrontalElevenByEleven) {
  const BoardScene scene = frontal();
  const BoardResult result = find_board(picture_of(scene).view(), scene.problem());
  expect_whole_board(scene, result);
  EXPECT_EQ(result.equivalent_readings, 4);
  EXPECT_TRUE(result.dark_on_light);
}

TEST(Board, LightOnDark) {
  BoardScene scene = frontal();
  std::swap(scene.surface, scene.print);
  const BoardResult result = find_board(picture_of(scene).view(), scene.problem());
  expect_whole_board(scene, result);
  EXPECT_FALSE(result.dark_on_light);
}

class BoardTilt : public testing::TestWithParam<double> {};

TEST_P(BoardTilt, SixtyFiveDegreesAboutAnyAxis) {
  BoardScene scene;
  scene.diameter_mm = 6;
  scene.X_CB = board_pose(scene, 270, 65 * degree, GetParam(), 0.2);
  const BoardResult result = find_board(picture_of(scene).view(), scene.problem());
  ASSERT_FALSE(result.points.empty()) << result.reason;
  expect_whole_board(read_from(scene, result), result);
}

INSTANTIATE_TEST_SUITE_P(Axes, BoardTilt, testing::Values(0.0, 0.8, 2.1));

// Normalised radius up to 0.62 in the corners: K r^2 = 0.11.
TEST(Board, StrongDistortionOfBothSigns) {
  for (const double K : {-0.3, 0.3}) {
    BoardScene scene;
    scene.camera = {768, 572, 780, 775, 392, 271, Division{K}};
    scene.pitch_mm = 12;
    scene.diameter_mm = 6;
    scene.X_CB = board_pose(scene, 230, 25 * degree, 1, 0.1);
    const BoardResult result = find_board(picture_of(scene).view(), scene.problem());
    ASSERT_FALSE(result.points.empty()) << result.reason;
    expect_whole_board(read_from(scene, result), result);
  }
}

// The first point is the corner nearest to the top left pixel, and the reading is never mirrored.
TEST(Board, TurnedByAnyAngle) {
  for (int k = 0; k < 4; ++k) {
    BoardScene scene;
    scene.camera = {480, 480, 800, 800, 240, 240, Division{0}};
    scene.rows = 7;
    scene.cols = 9;
    scene.X_CB = board_pose(scene, 260, 15 * degree, 2.0, 0.1 + 1.7 * k);
    const BoardResult result = find_board(picture_of(scene).view(), scene.problem());
    ASSERT_FALSE(result.points.empty()) << result.reason;
    const BoardScene read = read_from(scene, result);
    expect_whole_board(read, result);
    EXPECT_EQ(result.equivalent_readings, 2);
    EXPECT_LT(read.seen_px({0, 0}).norm(), read.seen_px({6, 8}).norm());
  }
}

TEST(Board, FiveByFiveUnderUnevenLight) {
  BoardScene scene;
  scene.camera = {640, 480, 900, 900, 320, 240, Division{0.1}};
  scene.rows = scene.cols = 5;
  scene.pitch_mm = 20;
  scene.diameter_mm = 10;
  scene.X_CB = board_pose(scene, 300, 40 * degree, 0.4, 0);
  scene.surface = 160;
  scene.shading_per_px = test::shading_of_ratio(scene.camera, 3);
  const BoardResult result = find_board(picture_of(scene).view(), scene.problem());
  ASSERT_FALSE(result.points.empty()) << result.reason;
  expect_whole_board(read_from(scene, result), result);
}

// Eleven rows: only one reading. Its frame does not turn with the image.
TEST(Board, AsymmetricHasOneReading) {
  for (int k = 0; k < 4; ++k) {
    BoardScene scene;
    scene.kind = BoardKind::asymmetric_circles;
    scene.camera = {480, 480, 800, 800, 240, 240, Division{0}};
    scene.rows = 11;
    scene.cols = 4;
    scene.X_CB = board_pose(scene, 260, 30 * degree, 1.0, 0.2 + 1.7 * k);
    const BoardResult result = find_board(picture_of(scene).view(), scene.problem());
    expect_whole_board(scene, result);
    EXPECT_EQ(result.equivalent_readings, 1);
  }
}

TEST(Board, HiddenCirclesAreNamed) {
  BoardScene scene = frontal();
  std::mt19937_64 random(4);
  std::bernoulli_distribution hidden(0.3);
  for (int row = 0; row < scene.rows; ++row)
    for (int col = 0; col < scene.cols; ++col)
      if (hidden(random)) scene.unprinted.push_back({row, col});
  const BoardResult result = find_board(picture_of(scene).view(), scene.problem());
  ASSERT_EQ(result.status, BoardStatus::found) << result.reason;
  EXPECT_EQ(result.missing, scene.unprinted);
  EXPECT_EQ(result.points.size(), 121 - scene.unprinted.size());
  EXPECT_LT(errors_of(scene, result).worst_px, 0.05);
  EXPECT_NE(result.reason.find("found " + std::to_string(result.points.size()) + " of 121 circles"),
            std::string::npos)
      << result.reason;
}

// A bar across the board, slightly askew: circles that it cuts are missing, not biased.
TEST(Board, CutCirclesDoNotCount) {
  BoardScene scene = frontal();
  scene.covers.push_back({{{300, -5}, {372, -5}, {420, 600}, {348, 600}}, 60});
  const BoardResult result = find_board(picture_of(scene).view(), scene.problem());
  ASSERT_EQ(result.status, BoardStatus::found) << result.reason;
  EXPECT_TRUE(result.place_known);
  EXPECT_GT(result.points.size(), 85U);
  EXPECT_LT(result.points.size(), 110U);
  EXPECT_LT(errors_of(scene, result).worst_px, 0.08);
}

TEST(Board, HiddenOuterColumnIsAmbiguousUnlessAPartWillDo) {
  BoardScene scene = frontal();
  for (int row = 0; row < 11; ++row) scene.unprinted.push_back({row, 0});
  const Pixels pixels = picture_of(scene);
  BoardProblem problem = scene.problem();
  const BoardResult strict = find_board(pixels.view(), problem);
  EXPECT_EQ(strict.status, BoardStatus::ambiguous);
  EXPECT_TRUE(strict.points.empty());
  EXPECT_NE(strict.reason.find("found 110 of 121 circles"), std::string::npos) << strict.reason;

  problem.partial = true;
  const BoardResult part = find_board(pixels.view(), problem);
  ASSERT_EQ(part.status, BoardStatus::found) << part.reason;
  EXPECT_FALSE(part.place_known);
  ASSERT_EQ(part.points.size(), 110U);
  EXPECT_EQ(part.points.front().at, (BoardIndex{0, 0}));
  // The board's frame is one pitch off, the same for all points.
  for (const BoardPoint& point : part.points)
    EXPECT_LT((point.u_px - scene.seen_px({point.at.row, point.at.col + 1})).norm(), 0.05);
}

TEST(Board, ClutterRoundItAndOnIt) {
  BoardScene scene = frontal();
  scene.rows = 9;
  scene.X_CB = board_pose(scene, 340, 30 * degree, 0.7, 0.3);
  std::mt19937_64 random(8);
  std::uniform_real_distribution<double> place(-45, 145), size(3, 8);
  for (int k = 0; k < 60; ++k) {
    const Vector2d at(place(random), place(random));
    const bool on_board = at.x() > -8 && at.x() < 108 && at.y() > -8 && at.y() < 88;
    if (!on_board) scene.spots.push_back({at, size(random)});
  }
  for (int k = 0; k < 6; ++k) scene.spots.push_back({{5.0 + 10 * k, 15.0 + 10 * k}, 2.5});
  const BoardResult result = find_board(picture_of(scene).view(), scene.problem());
  ASSERT_FALSE(result.points.empty()) << result.reason;
  expect_whole_board(read_from(scene, result), result);
}

TEST(Board, WrongNumberOfRowsIsSaid) {
  BoardScene scene = frontal();
  scene.rows = 8;
  scene.cols = 9;
  const Pixels pixels = picture_of(scene);
  BoardProblem problem = scene.problem();
  problem.rows = 7;
  const BoardResult less = find_board(pixels.view(), problem);
  EXPECT_EQ(less.status, BoardStatus::wrong_size) << less.reason;
  EXPECT_NE(less.reason.find("72 circles"), std::string::npos) << less.reason;
  problem.rows = 10;
  const BoardResult more = find_board(pixels.view(), problem);
  EXPECT_EQ(more.status, BoardStatus::ambiguous) << more.reason;
  problem.rows = problem.cols = 20;
  EXPECT_EQ(find_board(pixels.view(), problem).status, BoardStatus::too_few);
  for (const auto& result : {less, more}) EXPECT_TRUE(result.points.empty());
}

TEST(Board, NothingInTheImage) {
  Pixels pixels{640, 480, 640, std::vector<std::uint8_t>(640 * 480, 128)};
  BoardProblem problem = BoardScene().problem();
  for (const BoardKind kind : {BoardKind::circles, BoardKind::asymmetric_circles, BoardKind::chessboard}) {
    problem.kind = kind;
    const BoardResult result = find_board(pixels.view(), problem);
    EXPECT_EQ(result.status, BoardStatus::no_grid);
    EXPECT_FALSE(result.reason.empty());
  }
}

TEST(Board, NothingButNoise) {
  for (const double sigma : {2.0, 10.0, 60.0}) {
    std::mt19937_64 random(3);
    const Pixels pixels = expose({400, 300, std::vector<double>(400 * 300, 120)}, sigma, random);
    for (const int rows : {3, 11}) {
      BoardProblem problem = BoardScene().problem();
      problem.rows = problem.cols = rows;
      for (const BoardKind kind :
           {BoardKind::circles, BoardKind::asymmetric_circles, BoardKind::chessboard}) {
        problem.kind = kind;
        EXPECT_NE(find_board(pixels.view(), problem).status, BoardStatus::found);
      }
    }
  }
}

TEST(Board, ProblemsThatMakeNoSense) {
  const Pixels pixels{64, 64, 64, std::vector<std::uint8_t>(64 * 64, 128)};
  const auto status_with = [&](auto change) {
    BoardProblem problem = BoardScene().problem();
    change(problem);
    const BoardResult result = find_board(pixels.view(), problem);
    EXPECT_FALSE(result.reason.empty());
    return result.status;
  };
  EXPECT_EQ(status_with([](BoardProblem& p) { p.rows = 1; }), BoardStatus::wrong_problem);
  EXPECT_EQ(status_with([](BoardProblem& p) { p.cols = -3; }), BoardStatus::wrong_problem);
  EXPECT_EQ(status_with([](BoardProblem& p) { p.rows = 2000000000; }), BoardStatus::wrong_problem);
  EXPECT_EQ(status_with([](BoardProblem& p) { p.pitch_mm = 0; }), BoardStatus::wrong_problem);
  EXPECT_EQ(status_with([](BoardProblem& p) { p.pitch_mm = std::nan(""); }), BoardStatus::wrong_problem);
  EXPECT_EQ(status_with([](BoardProblem& p) { p.min_axis_ratio = 2; }), BoardStatus::wrong_problem);
  EXPECT_EQ(find_board({}, BoardScene().problem()).status, BoardStatus::empty_image);
  EXPECT_EQ(find_board({pixels.grey.data(), 3, 64, 64}, BoardScene().problem()).status,
            BoardStatus::empty_image);
  EXPECT_EQ(BoardResult{}.status, BoardStatus::failed);
}

TEST(Board, RepeatsBitByBit) {
  BoardScene scene = frontal();
  scene.X_CB = board_pose(scene, 330, 0.5, 1, 0.4);
  const Pixels pixels = picture_of(scene);
  const BoardResult a = find_board(pixels.view(), scene.problem()),
                    b = find_board(pixels.view(), scene.problem());
  ASSERT_EQ(a.points.size(), b.points.size());
  for (std::size_t k = 0; k < a.points.size(); ++k) {
    EXPECT_EQ(a.points[k].u_px, b.points[k].u_px);
    EXPECT_EQ(a.points[k].covariance_px2, b.points[k].covariance_px2);
  }
}

}  // namespace
}  // namespace zeropose
