// The gun-check cell from rendered pictures to the verdict (spec 70), and the fifteen published positions.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "sim/wrong_calibration.h"
#include "tests/support/cell_scene.h"
#include "tests/support/csv.h"
#include "tests/support/rendered_example.h"

namespace zeropose {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

Vector6 numbers_of(const Pose& X_AB) {
  const SixNumbers s = to_six_numbers(X_AB);
  return {s.x_mm, s.y_mm, s.z_mm, s.rx_deg, s.ry_deg, s.rz_deg};
}

// Relative poses to position 1, of the published measurement (Table 5.2).
std::vector<Pose> published_poses() {
  const test::CsvTable table("tests/golden/mono-15-relative.csv");
  std::vector<Pose> poses;
  for (std::size_t row = 0; row < table.size(); ++row)
    poses.push_back(from_six_numbers({table.number(row, "x_mm"), table.number(row, "y_mm"),
                                      table.number(row, "z_mm"), table.number(row, "rx_deg"),
                                      table.number(row, "ry_deg"), table.number(row, "rz_deg")}));
  return poses;
}

// As the published comparison with a laser tracker: six numbers minus six numbers, and of those differences
// the largest deviation from their mean, component by component.
class Differences {
 public:
  void add(const Pose& X_O0O, const Pose& X_O0O_true) {
    Vector6 difference = numbers_of(X_O0O) - numbers_of(X_O0O_true);
    for (double& deg : difference.tail<3>()) deg = std::remainder(deg, 360);
    all_.push_back(difference);
  }
  const Vector6& last() const { return all_.back(); }
  Vector6 largest_from_mean() const {
    Vector6 mean = Vector6::Zero(), largest = Vector6::Zero();
    for (const Vector6& one : all_) mean += one / static_cast<double>(all_.size());
    for (const Vector6& one : all_) largest = largest.cwiseMax((one - mean).cwiseAbs());
    return largest;
  }

 private:
  std::vector<Vector6> all_;
};

// Published, recomputed from Tables 5.2 and 5.3.
const Vector6 published_largest{0.08, 0.06, 0.56, 0.05, 0.05, 0.17};

void print(const char* title, const Vector6& six) {
  std::printf("| %s | %.3f %.3f %.3f | %.4f %.4f %.4f |\n", title, six(0), six(1), six(2), six(3), six(4),
              six(5));
}

// How far the balls' centres are off their coordinates when a coordinate measuring machine took them.
constexpr double drawing_mm = 0.003;

class GunCheck : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    cell = new test::RenderedExample("gun-check", drawing_mm);
    zero = new ZeroResult(cell->zero(cell->believed()));
  }
  static void TearDownTestSuite() {
    delete zero;
    delete cell;
  }
  void SetUp() override { ASSERT_EQ(zero->code, Code::ok) << zero->reason; }

  const Job& job() const { return cell->job(); }

  static test::RenderedExample* cell;
  static ZeroResult* zero;
};

test::RenderedExample* GunCheck::cell = nullptr;
ZeroResult* GunCheck::zero = nullptr;

// The robot knows within a millimetre where it put the gun: there the marks are searched.
Pose robot_believes(const Pose& X_WO) { return X_WO * from_six_numbers({0.6, -0.5, 0.8, 0.2, -0.3, 0.4}); }

TEST_F(GunCheck, HalvesThePublishedDeviations) {
  const Job now = compensated(job(), zero->zero);
  Differences differences;
  const std::vector<Pose> poses = published_poses();
  for (std::size_t i = 1; i < poses.size(); ++i) {
    const Pose X_WO = cell->zero_pose() * poses[i];
    test::Exposed frame = cell->exposed(cell->clean(X_WO));
    const auto found =
        observations_of(find_job_marks(frame.images(), now, cell->believed(), robot_believes(X_WO)), now);
    const PoseResult pose = estimate_pose(test::problem_of(cell->believed(), now, found, zero->zero.X_WO0));
    ASSERT_EQ(pose.code, Code::ok) << "position " << i + 1 << ": " << pose.reason;
    EXPECT_GE(pose.effective_marks, 6) << "position " << i + 1;
    EXPECT_THAT(pose.removed, IsEmpty()) << "position " << i + 1;
    differences.add(zero->zero.X_WO0.inverse() * pose.X_WO, poses[i]);
    print(std::to_string(i + 1).c_str(), differences.last());
  }
  const Vector6 largest = differences.largest_from_mean();
  print("rendered, calibration of seed 1", largest);
  EXPECT_TRUE((largest.array() <= published_largest.array() / 2).all()) << largest.transpose();
}

// Where the balls are found is where the true camera sees their outlines' middles.
TEST_F(GunCheck, FindsBallsWhereTheyAre) {
  test::Exposed frame = cell->exposed(cell->clean(cell->zero_pose()));
  const auto found =
      observations_of(find_job_marks(frame.images(), job(), cell->scene().cameras, cell->zero_pose()), job());
  Job real = job();
  real.marks = cell->scene().marks;
  test::Random unused(1);
  const auto exact = test::observe(cell->scene().cameras, real, cell->zero_pose(), 0, unused);
  ASSERT_EQ(found.size(), exact.size());
  constexpr double background_px = 0.005;  // what dirt and the lamps behind the plate do
  for (std::size_t i = 0; i < found.size(); ++i)
    EXPECT_LT((found[i].u_px - exact[i].u_px).norm(),
              4 * std::sqrt(found[i].covariance_px2.trace()) + background_px)
        << job().marks[found[i].mark].name;
}

// Within the limits ok and how far off, beyond them the code of the limit.
TEST_F(GunCheck, GivesTheVerdict) {
  const auto verdict = [&](const SixNumbers& six) {
    const Pose X_O0O = from_six_numbers(six);
    const Measurement measurement = cell->measured(zero->zero, X_O0O);
    EXPECT_EQ(measurement.code == Code::ok, measurement.reason.empty());
    if (measurement.code == Code::ok) {
      const Vector6 error = (numbers_of(measurement.X_O0O) - numbers_of(X_O0O)).cwiseAbs();
      EXPECT_TRUE((error.array() <= published_largest.array() / 2).all()) << error.transpose();
    }
    return measurement.code;
  };
  EXPECT_EQ(verdict({2.9, -2.9, 7.7, 0.9, -0.9, 8.9}), Code::ok);
  EXPECT_EQ(verdict({-1.2, 0.4, -7.5, -0.3, 0.7, -6}), Code::ok);
  EXPECT_EQ(verdict({3.2, 0, 0, 0, 0, 0}), Code::limit_x);
  EXPECT_EQ(verdict({0, -3.2, 0, 0, 0, 0}), Code::limit_y);
  EXPECT_EQ(verdict({0, 0, 8.4, 0, 0, 0}), Code::limit_z);
  EXPECT_EQ(verdict({0, 0, 0, -1.15, 0, 0}), Code::limit_rx);
  EXPECT_EQ(verdict({0, 0, 0, 0, 1.15, 0}), Code::limit_ry);
  EXPECT_EQ(verdict({0, 0, 0, 0, 0, 9.3}), Code::limit_rz);
}

TEST_F(GunCheck, GoesOnWithABallCoveredAndRemovesAWrongOne) {
  const Pose X_O0O = from_six_numbers({1, -1, 3, 0.2, -0.4, 3});
  const Measurement covered = cell->measured(zero->zero, X_O0O, {{"ball 4"}, {}});
  ASSERT_EQ(covered.code, Code::ok) << covered.reason;
  EXPECT_EQ(covered.pose.effective_marks, 11);
  EXPECT_THAT(test::removed_marks(covered, job()), IsEmpty());
  const Measurement wrong = cell->measured(zero->zero, X_O0O, {{}, {{"ball 9", 6}}});
  ASSERT_EQ(wrong.code, Code::ok) << wrong.reason;
  EXPECT_THAT(test::removed_marks(wrong, job()), ElementsAre("ball 9"));
}

TEST_F(GunCheck, NamesTooFewBalls) {
  const Faults faults{{"ball 1", "ball 2", "ball 3", "ball 4", "ball 5", "ball 6", "ball 7"}, {}};
  EXPECT_EQ(cell->measured(zero->zero, Pose::Identity(), faults).code, Code::too_few_marks);
}

// What dominates at the published positions, without pictures: the tables of docs/cells.md.
struct Budget {
  const char* name;
  double sigma_px;
  CalibrationErrors calibration;
  double drawing_mm;  // of each coordinate of a ball's centre
};

// The largest differences of one calibration, zero and fifteen positions.
Vector6 largest_of(const test::RenderedExample& cell, const Budget& budget, std::uint64_t seed) {
  const auto& cameras = cell.scene().cameras;
  const auto believed = wrong_calibration(cameras, budget.calibration, seed);
  test::Random random(seed);
  Job real = cell.job();
  for (Mark& mark : real.marks)
    for (double& coordinate : mark.p_O_mm) coordinate += test::normal(random, budget.drawing_mm);
  std::vector<std::vector<Observation>> frames;
  for (int i = 0; i < 10; ++i)
    frames.push_back(test::observe(cameras, real, cell.zero_pose(), budget.sigma_px, random));
  const ZeroResult zero = make_zero(believed, cell.job(), frames);
  EXPECT_EQ(zero.code, Code::ok) << zero.reason;
  const Job now = compensated(cell.job(), zero.zero);
  Differences differences;
  const std::vector<Pose> poses = published_poses();
  for (std::size_t i = 1; i < poses.size(); ++i) {
    auto seen = test::observe(cameras, real, cell.zero_pose() * poses[i], budget.sigma_px, random);
    std::erase_if(seen, [&](const Observation& one) { return !in_image(cameras[0].model, one.u_px); });
    const PoseResult pose = estimate_pose(test::problem_of(believed, now, seen, zero.zero.X_WO0 * poses[i]));
    EXPECT_EQ(pose.code, Code::ok) << "seed " << seed << " position " << i + 1 << ": " << pose.reason;
    differences.add(zero.zero.X_WO0.inverse() * pose.X_WO, poses[i]);
  }
  return differences.largest_from_mean();
}

TEST_F(GunCheck, BudgetOfThePublishedPositions) {
  const CalibrationErrors none{0, 0, 0, 0}, practice;
  const auto rms = [](const Budget& budget) {
    constexpr int seeds = 100;
    Vector6 squares = Vector6::Zero();
    for (std::uint64_t seed = 1; seed <= seeds; ++seed)
      squares += largest_of(*cell, budget, seed).cwiseAbs2() / seeds;
    print(budget.name, squares.cwiseSqrt());
    return Vector6(squares.cwiseSqrt());
  };
  const Vector6 marks = rms({"marks 0.02 px", 0.02, none, 0});
  rms({"focal length 0.05 %", 0, {0, 0, 0.0005, 0}, 0});
  rms({"image origin 4.5 px", 0, {0, 0, 0, 4.5}, 0});
  const Vector6 calibration = rms({"calibration, all of it", 0, practice, 0});
  const Vector6 drawing = rms({"balls 0.003 mm off their coordinates", 0, none, drawing_mm});
  const Vector6 all = rms({"all of that", 0.02, practice, drawing_mm});
  rms({"all of that, marks 0.1 px", 0.1, practice, drawing_mm});
  rms({"all of that, balls 0.01 mm off", 0.02, practice, 0.01});
  EXPECT_TRUE((all.array() <= published_largest.array() / 2).all()) << all.transpose();
  // What is worth improving: the balls' coordinates across the line of sight, the calibration along it.
  EXPECT_GT(drawing(0), 1.3 * std::max(marks(0), calibration(0)));
  EXPECT_GT(calibration(2), 2 * drawing(2));
}

}  // namespace
}  // namespace zeropose
