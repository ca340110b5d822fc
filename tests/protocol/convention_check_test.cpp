// The convention check proves what is right and catches what is wrong: every maker's order read as every
// other's, inverses, other frames, signs and units.
#include "protocol/convention_check.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <random>
#include <stdexcept>

namespace zeropose {
namespace {

using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;

const Pose taught = from_six_numbers({900, -200, 650, 30, -40, 70});  // X_RO0, turned about every axis

std::vector<Convention> on_the_wire() {
  std::vector<Convention> list(all_conventions().begin(), all_conventions().end());
  std::erase(list, Convention::matrix);
  return list;
}

// A robot whose maker writes poses as `speaks` and that is brought to X_RP(shift).
template <typename Where>
ConventionCheck seen_by(Convention speaks, Convention configured, const Pose& X_RO0, const Where& where) {
  ConventionCheck check;
  check.convention = configured;
  check.shifts = known_shifts();
  check.at_zero = to_maker(speaks, X_RO0);
  for (const KnownShift& shift : check.shifts)
    check.went.push_back(to_maker(speaks, where(X_RO0, shift.X_O0O)));
  return check;
}

Pose with_the_object(const Pose& X_RO0, const Pose& X_O0O) { return X_RO0 * X_O0O; }
Pose opposite(const Pose& X_RO0, const Pose& X_O0O) { return X_RO0 * X_O0O.inverse(); }
Pose along_base_axes(const Pose& X_RO0, const Pose& X_O0O) { return X_O0O * X_RO0; }

TEST(ConventionCheck, EveryTurnIsAtLeastTenDegreesAndEveryAxisIsShifted) {
  Eigen::Vector3d shifted(0, 0, 0), turned(0, 0, 0);
  for (const KnownShift& shift : known_shifts()) {
    const Eigen::Vector3d phi = log_so3(shift.X_O0O.linear()) * degrees_per_radian;
    if (phi.norm() > 0) {
      EXPECT_GE(phi.norm(), 10 - 1e-9) << shift.name;
    }
    shifted += shift.X_O0O.translation().cwiseAbs();
    turned += phi.cwiseAbs();
  }
  EXPECT_GE(shifted.minCoeff(), 10);
  EXPECT_GE(turned.minCoeff(), 10);
}

TEST(ConventionCheck, EveryMakerIsProvenByItsOwnNumbers) {
  for (const Convention maker : on_the_wire()) {
    const ConventionVerdict verdict = check_convention(seen_by(maker, maker, taught, with_the_object));
    EXPECT_TRUE(verdict.proven) << name_of(maker) << verdict.text;
    EXPECT_THAT(verdict.explanations, testing::IsEmpty());
    EXPECT_THAT(verdict.same, Contains(maker));
  }
}

TEST(ConventionCheck, AlsoWithTheErrorsOfARobotThatTouchesThreePoints) {
  std::mt19937_64 random(80);
  std::uniform_real_distribution<double> mm(-0.5, 0.5), deg(-0.2, 0.2);
  const auto touched = [&](const Pose& X_RO0, const Pose& X_O0O) {
    return X_RO0 * X_O0O *
           from_six_numbers({mm(random), mm(random), mm(random), deg(random), deg(random), deg(random)});
  };
  for (const Convention maker : on_the_wire())
    EXPECT_TRUE(check_convention(seen_by(maker, maker, taught, touched)).proven) << name_of(maker);
}

// Makers that write the same numbers in the same order: nothing that a robot shows tells them apart, and
// nothing depends on it.
TEST(ConventionCheck, TheClassesOfEqualNumbersAreThese) {
  using enum Convention;
  const std::vector<std::vector<Convention>> classes = {{generic, fanuc, yaskawa, mitsubishi, denso, techman},
                                                        {kuka, epson},
                                                        {kawasaki, comau, adept, doosan},
                                                        {staubli},
                                                        {abb},
                                                        {universal_robots}};
  for (const auto& a : classes)
    for (const auto& b : classes)
      for (const Convention one : a)
        for (const Convention other : b)
          EXPECT_EQ(writes_the_same(one, other), &a == &b) << name_of(one) << " and " << name_of(other);
}

// 15 by 15: a robot of one maker, configured as another.
TEST(ConventionCheck, EveryWrongConventionIsCaughtAndTheRightOneNamed) {
  int caught = 0, refused = 0;
  for (const Convention speaks : on_the_wire()) {
    for (const Convention configured : on_the_wire()) {
      if (writes_the_same(speaks, configured)) continue;
      const ConventionCheck check = seen_by(speaks, configured, taught, with_the_object);
      if (field_names(speaks).size() != field_names(configured).size()) {
        EXPECT_THROW(check_convention(check), std::invalid_argument);  // seven numbers are not six
        ++refused;
        continue;
      }
      const ConventionVerdict verdict = check_convention(check);
      EXPECT_FALSE(verdict.proven) << name_of(speaks) << " read as " << name_of(configured);
      EXPECT_THAT(verdict.explanations, Contains(HasSubstr(name_of(speaks))))
          << name_of(speaks) << " read as " << name_of(configured) << ": " << verdict.text;
      ++caught;
    }
  }
  EXPECT_EQ(refused, 2 * 14);
  EXPECT_EQ(caught, 15 * 15 - 6 * 6 - 2 * 2 - 4 * 4 - 3 - refused);
}

// Where the robot shows the shift itself, its zero is the identity: the pose with all turns still tells.
TEST(ConventionCheck, WrongConventionsAreCaughtInShiftsFromNothingAsWell) {
  for (const Convention speaks : on_the_wire()) {
    for (const Convention configured : on_the_wire()) {
      if (writes_the_same(speaks, configured) || field_names(speaks).size() != field_names(configured).size())
        continue;
      EXPECT_FALSE(check_convention(seen_by(speaks, configured, Pose::Identity(), with_the_object)).proven)
          << name_of(speaks) << " read as " << name_of(configured);
    }
  }
}

TEST(ConventionCheck, TheInverseIsCaughtForEveryMaker) {
  for (const Convention maker : on_the_wire()) {
    const ConventionVerdict verdict = check_convention(seen_by(maker, maker, taught, opposite));
    EXPECT_FALSE(verdict.proven);
    for (const ShiftVerdict& shift : verdict.shifts) EXPECT_FALSE(shift.agrees) << shift.text;
    EXPECT_THAT(verdict.explanations, ElementsAre(HasSubstr("opposite way"))) << name_of(maker);
  }
}

TEST(ConventionCheck, TheBasesAxesAreCaughtForEveryMaker) {
  for (const Convention maker : on_the_wire()) {
    const ConventionVerdict verdict = check_convention(seen_by(maker, maker, taught, along_base_axes));
    EXPECT_FALSE(verdict.proven);
    EXPECT_THAT(verdict.explanations, ElementsAre(HasSubstr("robot's base"))) << name_of(maker);
  }
}

TEST(ConventionCheck, TwoMistakesAtOnceAreNamed) {
  const ConventionVerdict verdict =
      check_convention(seen_by(Convention::staubli, Convention::kuka, taught, opposite));
  EXPECT_FALSE(verdict.proven);
  EXPECT_THAT(verdict.explanations, Contains(testing::AllOf(HasSubstr("staubli"), HasSubstr("opposite"))));
}

TEST(ConventionCheck, AnInvertedSignIsNamed) {
  ConventionCheck check = seen_by(Convention::kuka, Convention::kuka, taught, with_the_object);
  check.at_zero[5] *= -1;
  for (auto& values : check.went) values[5] *= -1;
  const ConventionVerdict verdict = check_convention(check);
  EXPECT_FALSE(verdict.proven);
  EXPECT_THAT(verdict.explanations, ElementsAre("inverted sign of C"));
}

TEST(ConventionCheck, AWrongUnitIsNamed) {
  ConventionCheck check =
      seen_by(Convention::universal_robots, Convention::universal_robots, taught, with_the_object);
  for (std::size_t i = 0; i < 3; ++i) {
    check.at_zero[i] *= 1000;
    for (auto& values : check.went) values[i] *= 1000;
  }
  const ConventionVerdict verdict = check_convention(check);
  EXPECT_FALSE(verdict.proven);
  EXPECT_THAT(verdict.explanations, ElementsAre(HasSubstr("in mm where the convention has m")));
}

TEST(ConventionCheck, OneWrongPoseIsNamedAndNothingElse) {
  ConventionCheck check = seen_by(Convention::abb, Convention::abb, taught, with_the_object);
  check.went[4] = check.went[3];
  const ConventionVerdict verdict = check_convention(check);
  EXPECT_FALSE(verdict.proven);
  EXPECT_THAT(verdict.explanations, testing::IsEmpty());
  EXPECT_THAT(verdict.text, HasSubstr("nothing known explains it"));
  for (std::size_t i = 0; i < verdict.shifts.size(); ++i) EXPECT_EQ(verdict.shifts[i].agrees, i != 4);
  EXPECT_THAT(verdict.shifts[4].text, HasSubstr("turned 20 deg about y: DOES NOT AGREE"));
}

// One small turn proves nothing, although it agrees.
TEST(ConventionCheck, TooFewShiftsProveNothing) {
  ConventionCheck check;
  check.convention = Convention::fanuc;
  check.shifts = {{"shifted 30 mm along x", from_six_numbers({30, 0, 0, 0, 0, 0})}};
  check.at_zero = {0, 0, 0, 0, 0, 0};
  check.went = {{30, 0, 0, 0, 0, 0}};
  const ConventionVerdict verdict = check_convention(check);
  EXPECT_TRUE(verdict.shifts[0].agrees);
  EXPECT_FALSE(verdict.proven);
  EXPECT_THAT(verdict.text, HasSubstr("do not tell apart"));
}

TEST(ConventionCheck, AZeroThatIsHardlyTurnedIsSaid) {
  const Pose straight = from_six_numbers({900, 0, 600, 0, 0, 0});
  const ConventionVerdict verdict =
      check_convention(seen_by(Convention::fanuc, Convention::fanuc, straight, with_the_object));
  EXPECT_TRUE(verdict.proven);
  EXPECT_THAT(verdict.text, HasSubstr("less than 10 deg"));
  EXPECT_THAT(check_convention(seen_by(Convention::fanuc, Convention::fanuc, taught, with_the_object)).text,
              testing::Not(HasSubstr("less than 10 deg")));
}

TEST(ConventionCheck, RefusesWhatIsNoQuestion) {
  ConventionCheck check = seen_by(Convention::kuka, Convention::kuka, taught, with_the_object);
  check.went.pop_back();
  EXPECT_THROW(check_convention(check), std::invalid_argument);
  EXPECT_THROW(check_convention({}), std::invalid_argument);
  check = seen_by(Convention::kuka, Convention::kuka, taught, with_the_object);
  check.went[2].pop_back();
  EXPECT_THROW(check_convention(check), std::invalid_argument);
}

}  // namespace
}  // namespace zeropose
