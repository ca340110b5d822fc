#include "measure/correction.h"

#include <gtest/gtest.h>

#include <cstdio>
#include <fstream>
#include <set>
#include <string>
#include <utility>

#include "measure/code.h"
#include "tests/support/poses.h"

namespace zeropose {
namespace {

struct Poses {
  Pose X_WR, X_WO0, X_WO;
  explicit Poses(test::Random& random)
      : X_WR(test::uniform_pose(random, 3000)),
        X_WO0(test::uniform_pose(random, 3000)),
        X_WO(moved(X_WO0, (Vector6() << 12, -20, 5, 0.01, -0.02, 0.03).finished())) {}
  Pose of(CorrectionFrame frame) const { return correction(frame, X_WR, X_WO0, X_WO); }
};

TEST(Correction, CarriesTheToolFromTheZeroObjectToTheObject) {
  test::Random random(1);
  for (int trial = 0; trial < 100; ++trial) {
    const Poses poses(random);
    const Eigen::Vector3d p_O(100, -200, 300);
    const Eigen::Vector3d p_W0 = poses.X_WO0 * p_O, p_W = poses.X_WO * p_O;
    const Eigen::Vector3d p_R0 = poses.X_WR.inverse() * p_W0, p_R = poses.X_WR.inverse() * p_W;
    EXPECT_LT((poses.of(CorrectionFrame::world_shift) * p_W0 - p_W).norm(), 1e-9);
    EXPECT_LT((poses.of(CorrectionFrame::robot_base_shift) * p_R0 - p_R).norm(), 1e-9);
    EXPECT_LT((poses.of(CorrectionFrame::user_frame) * p_O - p_R).norm(), 1e-9);
    EXPECT_LT((poses.X_WO0 * poses.of(CorrectionFrame::object_zero) * p_O - p_W).norm(), 1e-9);
  }
}

TEST(Correction, OfTheZeroObjectIsNone) {
  test::Random random(2);
  Poses poses(random);
  poses.X_WO = poses.X_WO0;
  for (const auto frame :
       {CorrectionFrame::object_zero, CorrectionFrame::world_shift, CorrectionFrame::robot_base_shift})
    test::expect_near(poses.of(frame), Pose::Identity(), 1e-9, 1e-10);
}

TEST(Correction, WithoutAFrameIsNoNumber) {
  test::Random random(3);
  EXPECT_TRUE(Poses(random).of(CorrectionFrame::none).matrix().array().isNaN().all());
}

// The enum as written in the header, lines like "  ok = 0,": name and number of each code.
std::set<std::pair<std::string, int>> codes_of_header() {
  std::ifstream file(std::string(ZEROPOSE_SOURCE_DIR) + "/measure/code.h");
  std::set<std::pair<std::string, int>> codes;
  for (std::string text; std::getline(file, text);) {
    char name[64], comma = 0;
    int number = 0;
    if (std::sscanf(text.c_str(), "  %63[a-z_] = %d%c", name, &number, &comma) == 3 && comma == ',')
      codes.emplace(name, number);
  }
  return codes;
}

TEST(Codes, AreInTheTableOnceAndAscending) {
  const auto expected = codes_of_header();
  ASSERT_GT(expected.size(), 30u);
  std::set<std::pair<std::string, int>> table;
  int previous = -1;
  for (const CodeText& text : code_table()) {
    EXPECT_GT(static_cast<int>(text.code), previous);
    previous = static_cast<int>(text.code);
    table.emplace(text.name, previous);
    EXPECT_GT(text.cause.size(), 10u) << text.name;
    EXPECT_GT(text.remedy.size(), 10u) << text.name;
    EXPECT_EQ(text.cause.back(), '.') << text.name;
    EXPECT_EQ(&text_of(text.code), &text);
  }
  EXPECT_EQ(table, expected);
}

TEST(Codes, OfNoMeaningAreInternal) { EXPECT_EQ(text_of(static_cast<Code>(12345)).code, Code::internal); }

}  // namespace
}  // namespace zeropose
