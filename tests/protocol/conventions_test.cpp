#include "protocol/conventions.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>
#include <random>

#include "tests/protocol/amount.h"

namespace zeropose {
namespace {

using Eigen::Matrix3d;
using RowMatrix3 = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;

// Products of elementary rotation matrices, computed apart from this code base with plain sines and cosines.
constexpr double rz20_ry_35_rx50[] = {0.769751131320057, -0.632733191828594, -0.0844505997011977,
                                      0.280166499593235, 0.453744238593482,  -0.845944973653071,
                                      0.573576436351046, 0.627506871597133,  0.526540784518363};
constexpr double rz50_ry_35_rx20[] = {0.526540784518363, -0.845944973653071, -0.0844505997011977,
                                      0.627506871597133, 0.453744238593482,  -0.632733191828594,
                                      0.573576436351046, 0.280166499593235,  0.769751131320057};
constexpr double rz20_ry35_rz50[] = {0.232783859525344,  -0.809509887125231, 0.538985544695756,
                                     0.899933864980735,  0.38940278339356,   0.196174694969011,
                                     -0.368687826494612, 0.439385041770705,  0.819152044288992};
constexpr double rx20_ry_35_rz50[] = {0.526540784518363, -0.627506871597133, -0.573576436351046,
                                      0.593747647132838, 0.754301308516625,  -0.280166499593235,
                                      0.608455860159967, -0.193040571042685, 0.769751131320057};

struct Example {
  Convention convention;
  std::vector<double> maker_values;
  const double* R;
};

std::vector<Example> examples() {
  const std::vector<double> down{1, -2, 3, 20, -35, 50}, zyz{1, -2, 3, 20, 35, 50};
  const std::vector<double> quaternion{
      1, -2, 3, 0.829161648056623, 0.275247804080625, -0.198401312215331, 0.444259526686883};
  const std::vector<double> vector_m{
      0.001, -0.002, 0.003, 0.584156170508138, -0.421065487350988, 0.942848371444775};
  return {{Convention::generic, down, rz50_ry_35_rx20},
          {Convention::kuka, down, rz20_ry_35_rx50},
          {Convention::fanuc, down, rz50_ry_35_rx20},
          {Convention::techman, down, rz50_ry_35_rx20},
          {Convention::yaskawa, down, rz50_ry_35_rx20},
          {Convention::denso, down, rz50_ry_35_rx20},
          {Convention::mitsubishi, down, rz50_ry_35_rx20},
          {Convention::epson, down, rz20_ry_35_rx50},
          {Convention::kawasaki, zyz, rz20_ry35_rz50},
          {Convention::comau, zyz, rz20_ry35_rz50},
          {Convention::adept, zyz, rz20_ry35_rz50},
          {Convention::doosan, zyz, rz20_ry35_rz50},
          {Convention::staubli, down, rx20_ry_35_rz50},
          {Convention::abb, quaternion, rz50_ry_35_rx20},
          {Convention::universal_robots, vector_m, rz50_ry_35_rx20}};
}

Matrix3d matrix_of(const double* rows) { return Eigen::Map<const RowMatrix3>(rows); }

TEST(Conventions, EveryMakerHasAFixedExample) {
  std::vector<Convention> covered{Convention::matrix};  // the matrix itself: its own test
  for (const Example& example : examples()) covered.push_back(example.convention);
  EXPECT_THAT(covered,
              testing::UnorderedElementsAreArray(all_conventions().begin(), all_conventions().end()));
}

TEST(Conventions, ReadFixedExamples) {
  for (const Example& example : examples()) {
    const auto X = from_maker(example.convention, example.maker_values);
    ASSERT_TRUE(X) << name_of(example.convention);
    EXPECT_LT((X->linear() - matrix_of(example.R)).cwiseAbs().maxCoeff(), 1e-12)
        << name_of(example.convention);
    EXPECT_LT((X->translation() - Eigen::Vector3d(1, -2, 3)).norm(), 1e-12) << name_of(example.convention);
  }
}

TEST(Conventions, WriteFixedExamples) {
  for (const Example& example : examples()) {
    Pose X = Pose::Identity();
    X.linear() = matrix_of(example.R);
    X.translation() = Eigen::Vector3d(1, -2, 3);
    EXPECT_THAT(to_maker(example.convention, X),
                testing::Pointwise(testing::DoubleNear(1e-9), example.maker_values))
        << name_of(example.convention);
  }
}

TEST(Conventions, MatrixIsWrittenRowByRow) {
  Pose X = Pose::Identity();
  X.linear() = matrix_of(rz50_ry_35_rx20);
  X.translation() = Eigen::Vector3d(1, -2, 3);
  const auto& R = rz50_ry_35_rx20;
  const std::vector<double> rows{R[0], R[1], R[2], 1, R[3], R[4], R[5], -2, R[6], R[7], R[8], 3, 0, 0, 0, 1};
  EXPECT_EQ(to_maker(Convention::matrix, X), rows);
  EXPECT_TRUE(from_maker(Convention::matrix, rows));
}

double round_trip_error(Convention convention, const Pose& X) {
  const auto back = from_maker(convention, to_maker(convention, X));
  if (!back) return std::numeric_limits<double>::infinity();
  return std::max((back->linear() - X.linear()).cwiseAbs().maxCoeff(),
                  (back->translation() - X.translation()).cwiseAbs().maxCoeff());
}

TEST(Conventions, RoundTripOfRandomRotations) {
  std::mt19937_64 random(10);
  std::normal_distribution<double> normal;
  for (std::size_t i = 0; i < amount(100000); ++i) {
    Pose X = Pose::Identity();
    X.linear() = Eigen::Quaterniond(normal(random), normal(random), normal(random), normal(random))
                     .normalized()
                     .toRotationMatrix();
    X.translation() = 1000 * Eigen::Vector3d(normal(random), normal(random), normal(random));
    for (const Convention convention : all_conventions())
      ASSERT_LT(round_trip_error(convention, X), 1e-9) << name_of(convention) << " rotation " << i;
  }
}

// At every distance from the lock, where the outer two angles can hardly be told apart.
TEST(Conventions, RoundTripAtAndNearGimbalLock) {
  std::mt19937_64 random(11);
  std::uniform_real_distribution<double> angle(-180, 180);
  for (std::size_t i = 0; i < amount(20000); ++i) {
    const double near =
        i % 3 == 0 ? 0 : std::pow(10, -16.0 * static_cast<double>(i % 400) / 400) * (i % 2 ? 1 : -1);
    for (const double lock : {90.0, -90.0, 0.0, 180.0}) {
      Pose X = from_six_numbers({1, 2, 3, angle(random), 0, angle(random)});
      const Eigen::Vector3d axis =
          lock == 90 || lock == -90 ? Eigen::Vector3d::UnitY() : Eigen::Vector3d::UnitX();
      Matrix3d middle = Eigen::AngleAxisd((lock + near) / degrees_per_radian, axis).toRotationMatrix();
      const Matrix3d outer = Eigen::AngleAxisd(angle(random) / degrees_per_radian,
                                               i % 2 ? Eigen::Vector3d::UnitX() : Eigen::Vector3d::UnitZ())
                                 .toRotationMatrix();
      X.linear() = nearest_rotation(
          Eigen::AngleAxisd(angle(random) / degrees_per_radian, Eigen::Vector3d::UnitZ()).toRotationMatrix() *
          middle * outer);
      for (const Convention convention : all_conventions())
        ASSERT_LT(round_trip_error(convention, X), 1e-9)
            << name_of(convention) << " near " << lock << " by " << near;
    }
  }
}

TEST(Conventions, RefusesWhatIsNoPose) {
  constexpr double nan = std::numeric_limits<double>::quiet_NaN();
  constexpr double inf = std::numeric_limits<double>::infinity();
  EXPECT_FALSE(from_maker(Convention::kuka, std::vector<double>{1, 2, 3, 4, 5}));
  EXPECT_FALSE(from_maker(Convention::abb, std::vector<double>{1, 2, 3, 4, 5, 6}));
  EXPECT_FALSE(from_maker(Convention::kuka, std::vector<double>{1, 2, 3, 4, nan, 6}));
  EXPECT_FALSE(from_maker(Convention::fanuc, std::vector<double>{inf, 2, 3, 4, 5, 6}));
  EXPECT_FALSE(from_maker(Convention::abb, std::vector<double>{1, 2, 3, 1, 0.1, 0, 0}));
  EXPECT_FALSE(from_maker(Convention::abb, std::vector<double>{1, 2, 3, 0, 0, 0, 0}));
  std::vector<double> mirror{-1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1};
  EXPECT_FALSE(from_maker(Convention::matrix, mirror));
  std::vector<double> sheared{1, 0.01, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1};
  EXPECT_FALSE(from_maker(Convention::matrix, sheared));
  EXPECT_FALSE(from_maker(static_cast<Convention>(16), std::vector<double>{1, 2, 3, 4, 5, 6}));
}

TEST(Conventions, NamesAreReadBack) {
  for (const Convention convention : all_conventions()) {
    EXPECT_EQ(convention_named(name_of(convention)), convention);
    EXPECT_EQ(field_names(convention).size(), to_maker(convention, Pose::Identity()).size());
  }
  EXPECT_FALSE(convention_named("KUKA"));
  EXPECT_THAT(field_names(Convention::kuka), testing::ElementsAre("X", "Y", "Z", "A", "B", "C"));
}

}  // namespace
}  // namespace zeropose
