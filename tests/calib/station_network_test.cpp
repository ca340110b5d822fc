// A network of stations: exact where there is no noise, honest where there is, independent of frame and
// order; what cannot be oriented is named.
#include "calib/station_network.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <vector>

#include "tests/support/poses.h"

namespace zeropose {
namespace {

using Eigen::Vector3d;
using test::Random;
using testing::HasSubstr;

constexpr double quantile_3 = 7.8147, quantile_6 = 12.5916;  // 95 % of chi square

// The search ends when a step gains less than 1e-9 of the cost: with 15 degrees of freedom within 1.2e-4
// sigma of the least. Sigmas here are below 0.1 mm and 0.001 deg; two estimates are compared.
constexpr double still_mm = 3e-5, still_deg = 3e-7;

// A car body's surroundings: points about stations that stand metres apart.
struct Truth {
  std::vector<Pose> X_AS;
  std::vector<Vector3d> points_A;
};

Truth truth_of(Random& random, std::size_t stations, std::size_t points) {
  Truth truth;
  for (std::size_t s = 0; s < stations; ++s)
    truth.X_AS.push_back(s == 0 ? Pose::Identity() : test::uniform_pose(random, 4000));
  for (std::size_t i = 0; i < points; ++i) truth.points_A.push_back(test::uniform_vector(random, 2500));
  return truth;
}

// Which station sees which point: A 0-5, B 2-8, C 4-5, 7-10. From B to C there are five, from A to C two.
const std::vector<std::vector<std::size_t>> chain_of_three{
    {0, 1, 2, 3, 4, 5}, {2, 3, 4, 5, 6, 7, 8}, {4, 5, 6, 7, 8, 9, 10}};

StationNetworkProblem problem_of(const Truth& truth, const std::vector<std::vector<std::size_t>>& seen) {
  StationNetworkProblem problem;
  for (std::size_t s = 0; s < seen.size(); ++s) {
    problem.stations.push_back(std::string(1, char('A' + s)));
    for (const std::size_t point : seen[s])
      problem.observations.push_back({s, point, truth.X_AS[s].inverse() * truth.points_A[point], 0});
  }
  for (std::size_t i = 0; i < truth.points_A.size(); ++i)
    problem.points.push_back(std::string("P").append(std::to_string(i)));
  return problem;
}

void add_noise(Random& random, double sigma_mm, StationNetworkProblem& problem) {
  for (StationObservation& seen : problem.observations) {
    const double sigma = seen.sigma_mm > 0 ? seen.sigma_mm : sigma_mm;
    seen.p_S_mm += sigma * Vector3d(test::normal(random), test::normal(random), test::normal(random));
  }
}

std::size_t observation_of(const StationNetworkProblem& problem, std::size_t station, std::size_t point) {
  const auto found = std::ranges::find_if(problem.observations, [&](const StationObservation& seen) {
    return seen.station == station && seen.point == point;
  });
  return std::size_t(found - problem.observations.begin());
}

TEST(StationNetwork, CarriesEveryPointIntoTheFirstFrame) {
  Random random(1);
  for (int k = 0; k < 20; ++k) {
    const Truth truth = truth_of(random, 3, 11);
    const StationNetworkResult result = orient_stations(problem_of(truth, chain_of_three));
    ASSERT_EQ(result.status, StationNetworkStatus::ok) << result.reason;
    for (std::size_t s = 0; s < 3; ++s) test::expect_near(result.X_AS[s].X, truth.X_AS[s], 1e-7, 1e-8);
    for (std::size_t i = 0; i < 11; ++i) {
      ASSERT_TRUE(result.points[i].known);
      EXPECT_LT((result.points[i].p_A_mm - truth.points_A[i]).norm(), 1e-7);
    }
    // 20 observations, 11 points, two stations.
    EXPECT_EQ(result.redundancy, 60 - 33 - 12);
    EXPECT_TRUE(result.removed.empty());
    EXPECT_EQ(result.points[4].stations, 3);
    EXPECT_EQ(result.points[0].stations, 1);
  }
}

// Two stations are the best fit of two frames, to the covariance: the noise of both adds up in every pair.
TEST(StationNetwork, TwoStationsAreTheFitOfTwoFrames) {
  Random random(2);
  for (int k = 0; k < 20; ++k) {
    const Truth truth = truth_of(random, 2, 7);
    StationNetworkProblem problem = problem_of(truth, {{0, 1, 2, 3, 4, 5, 6}, {0, 1, 2, 3, 4, 5, 6}});
    for (StationObservation& seen : problem.observations) seen.sigma_mm = test::uniform(random, 0.01, 0.06);
    add_noise(random, 0, problem);
    std::vector<MeasuredPair> pairs;
    for (std::size_t i = 0; i < 7; ++i) {
      const StationObservation &a = problem.observations[i], &b = problem.observations[7 + i];
      pairs.push_back({a.p_S_mm, b.p_S_mm, a.sigma_mm * a.sigma_mm * Eigen::Matrix3d::Identity(),
                       b.sigma_mm * b.sigma_mm * Eigen::Matrix3d::Identity()});
    }
    const StationNetworkResult network = orient_stations(problem);
    const FrameFitResult frames = fit_frames(pairs);
    ASSERT_EQ(network.status, StationNetworkStatus::ok) << network.reason;
    ASSERT_EQ(frames.status, FrameFitStatus::ok) << frames.reason;
    test::expect_near(network.X_AS[1].X, frames.X_AB, still_mm, still_deg);
    EXPECT_LT((network.X_AS[1].covariance - frames.covariance).norm(), 1e-6 * frames.covariance.norm());
    EXPECT_EQ(network.redundancy, frames.redundancy);
  }
}

// Another frame in every station, the reference as well: the poses follow, residuals and sigmas stay.
TEST(StationNetwork, FollowsAChangeOfFrames) {
  Random random(3);
  const Truth truth = truth_of(random, 3, 11);
  StationNetworkProblem problem = problem_of(truth, chain_of_three);
  add_noise(random, 0.03, problem);
  const StationNetworkResult before = orient_stations(problem);
  ASSERT_EQ(before.status, StationNetworkStatus::ok) << before.reason;
  std::vector<Pose> X_NS;  // the new frame N of a station
  for (int s = 0; s < 3; ++s) X_NS.push_back(test::uniform_pose(random, 3000));
  for (StationObservation& seen : problem.observations) seen.p_S_mm = X_NS[seen.station] * seen.p_S_mm;
  const StationNetworkResult after = orient_stations(problem);
  ASSERT_EQ(after.status, StationNetworkStatus::ok) << after.reason;
  for (std::size_t s = 0; s < 3; ++s)
    test::expect_near(after.X_AS[s].X, X_NS[0] * before.X_AS[s].X * X_NS[s].inverse(), still_mm, still_deg);
  const Eigen::Matrix3d R = X_NS[0].linear();
  for (std::size_t i = 0; i < 11; ++i) {
    EXPECT_LT((after.points[i].p_A_mm - X_NS[0] * before.points[i].p_A_mm).norm(), still_mm);
    EXPECT_LT((after.points[i].covariance_mm2 - R * before.points[i].covariance_mm2 * R.transpose()).norm(),
              1e-6 * before.points[i].covariance_mm2.norm());
  }
  EXPECT_NEAR(after.sigma_mm, before.sigma_mm, 1e-9);
}

// The other station as the reference: its pose is the inverse, the points are the same ones.
TEST(StationNetwork, AnyStationMayBeTheReference) {
  Random random(4);
  StationNetworkProblem problem = problem_of(truth_of(random, 3, 11), chain_of_three);
  add_noise(random, 0.03, problem);
  problem.sigma_mm = 0.03;
  const StationNetworkResult in_A = orient_stations(problem);
  problem.reference = 2;
  const StationNetworkResult in_C = orient_stations(problem);
  ASSERT_EQ(in_C.status, StationNetworkStatus::ok) << in_C.reason;
  const Pose X_AC = in_A.X_AS[2].X;
  EXPECT_EQ(in_C.X_AS[2].X.matrix(), Pose::Identity().matrix());
  EXPECT_TRUE(in_C.X_AS[2].covariance.isZero());
  for (std::size_t s = 0; s < 3; ++s)
    test::expect_near(X_AC * in_C.X_AS[s].X, in_A.X_AS[s].X, still_mm, still_deg);
  for (std::size_t i = 0; i < 11; ++i)
    EXPECT_LT((X_AC * in_C.points[i].p_A_mm - in_A.points[i].p_A_mm).norm(), still_mm);
  EXPECT_NEAR(in_C.rms_mm, in_A.rms_mm, 1e-9);
}

TEST(StationNetwork, DoesNotMindTheOrder) {
  Random random(5);
  StationNetworkProblem problem = problem_of(truth_of(random, 3, 11), chain_of_three);
  add_noise(random, 0.03, problem);
  const StationNetworkResult before = orient_stations(problem);
  const std::vector<std::size_t> turned{2, 0, 1};  // where a station goes
  StationNetworkProblem other = problem;
  for (std::size_t s = 0; s < 3; ++s) other.stations[turned[s]] = problem.stations[s];
  for (StationObservation& seen : other.observations) seen.station = turned[seen.station];
  other.reference = turned[0];
  std::ranges::shuffle(other.observations, random);
  const StationNetworkResult after = orient_stations(other);
  ASSERT_EQ(after.status, StationNetworkStatus::ok) << after.reason;
  for (std::size_t s = 0; s < 3; ++s)
    test::expect_near(after.X_AS[turned[s]].X, before.X_AS[s].X, still_mm, still_deg);
  for (std::size_t i = 0; i < 11; ++i)
    EXPECT_LT((after.points[i].covariance_mm2 - before.points[i].covariance_mm2).norm(),
              1e-6 * before.points[i].covariance_mm2.norm());
}

// How many of the draws lie inside their 95 % ellipsoid, station by station and point by point.
struct Inside {
  std::vector<int> stations, points;
};

Inside count_inside(Random& random, double sigma_mm, bool known, int draws) {
  Inside inside{std::vector<int>(3, 0), std::vector<int>(11, 0)};
  for (int k = 0; k < draws; ++k) {
    const Truth truth = truth_of(random, 3, 11);
    StationNetworkProblem problem = problem_of(truth, chain_of_three);
    problem.sigma_mm = known ? sigma_mm : 0;
    if (known)
      for (std::size_t i = 0; i < problem.observations.size(); i += 3)
        problem.observations[i].sigma_mm = 2 * sigma_mm;
    add_noise(random, sigma_mm, problem);
    const StationNetworkResult result = orient_stations(problem);
    if (result.status != StationNetworkStatus::ok) continue;
    for (std::size_t s = 1; s < 3; ++s) {
      const Vector6 off = difference(truth.X_AS[s], result.X_AS[s].X);
      inside.stations[s] += off.dot(result.X_AS[s].covariance.ldlt().solve(off)) < quantile_6 ? 1 : 0;
    }
    for (std::size_t i = 0; i < 11; ++i) {
      const Vector3d off = result.points[i].p_A_mm - truth.points_A[i];
      inside.points[i] += off.dot(result.points[i].covariance_mm2.ldlt().solve(off)) < quantile_3 ? 1 : 0;
    }
  }
  return inside;
}

// Of 2000 draws 95 % +- 2 % is more than four sigma.
void expect_honest(const Inside& inside, int draws) {
  for (std::size_t s = 1; s < inside.stations.size(); ++s)
    EXPECT_NEAR(inside.stations[s], 0.95 * draws, 0.02 * draws) << "station " << s;
  for (std::size_t i = 0; i < inside.points.size(); ++i)
    EXPECT_NEAR(inside.points[i], 0.95 * draws, 0.02 * draws) << "point " << i;
}

TEST(StationNetwork, CovariancesHoldTheTruth) {
  Random random(6);
  expect_honest(count_inside(random, 0.03, true, 2000), 2000);
}

TEST(StationNetwork, CovariancesHoldTheTruthWithSigmaFromTheResiduals) {
  Random random(7);
  expect_honest(count_inside(random, 0.03, false, 2000), 2000);
}

TEST(StationNetwork, EstimatesTheSigma) {
  Random random(8);
  double variance = 0;
  constexpr int draws = 1000;
  for (int k = 0; k < draws; ++k) {
    StationNetworkProblem problem = problem_of(truth_of(random, 3, 11), chain_of_three);
    add_noise(random, 0.05, problem);
    const StationNetworkResult result = orient_stations(problem);
    ASSERT_EQ(result.status, StationNetworkStatus::ok) << result.reason;
    variance += result.sigma_mm * result.sigma_mm / draws;
  }
  // 15 degrees of freedom, 1000 draws: the mean variance is known to 1.2 %; five sigmas.
  EXPECT_NEAR(variance / (0.05 * 0.05), 1, 0.06);
}

// A point of three stations loses the wrong observation and keeps its place, one of two loses its place.
TEST(StationNetwork, NamesTheWrongObservation) {
  Random random(9);
  for (const double sigma_mm : {0.03, 0.0})
    for (const auto& [station, point] : {std::pair(1U, 4U), std::pair(2U, 5U), std::pair(0U, 2U)}) {
      const Truth truth = truth_of(random, 3, 11);
      StationNetworkProblem problem = problem_of(truth, chain_of_three);
      add_noise(random, 0.03, problem);
      problem.sigma_mm = sigma_mm;
      const std::size_t wrong = observation_of(problem, station, point);
      problem.observations[wrong].p_S_mm += Vector3d(1.5, -1.5, 1);
      const StationNetworkResult result = orient_stations(problem);
      ASSERT_EQ(result.status, StationNetworkStatus::ok) << result.reason;
      if (point != 2) {
        EXPECT_THAT(result.removed, testing::ElementsAre(wrong));
        EXPECT_TRUE(result.points[point].known);
        EXPECT_NEAR(result.residuals_A_mm[wrong].norm(), std::sqrt(5.5), 0.3);
      } else {
        EXPECT_THAT(result.removed, testing::UnorderedElementsAre(wrong, observation_of(problem, 1, 2)));
        EXPECT_FALSE(result.points[point].known);
      }
      for (std::size_t s = 1; s < 3; ++s) {
        const Vector6 off = difference(truth.X_AS[s], result.X_AS[s].X);
        EXPECT_LT(off.dot(result.X_AS[s].covariance.ldlt().solve(off)), 35);  // chance: 4e-6
      }
    }
}

// Two names exchanged in one station: metres, far beyond what is linear.
TEST(StationNetwork, FindsExchangedNames) {
  Random random(10);
  const Truth truth = truth_of(random, 2, 9);
  StationNetworkProblem problem =
      problem_of(truth, {{0, 1, 2, 3, 4, 5, 6, 7, 8}, {0, 1, 2, 3, 4, 5, 6, 7, 8}});
  add_noise(random, 0.03, problem);
  problem.sigma_mm = 0.03;
  std::swap(problem.observations[3].p_S_mm, problem.observations[6].p_S_mm);
  const StationNetworkResult result = orient_stations(problem);
  ASSERT_EQ(result.status, StationNetworkStatus::ok) << result.reason;
  EXPECT_THAT(result.removed, testing::UnorderedElementsAre(3, 6, 12, 15));
}

TEST(StationNetwork, DoesNotGuessWhichPointIsWrong) {
  Random random(11);
  StationNetworkProblem problem = problem_of(truth_of(random, 2, 3), {{0, 1, 2}, {0, 1, 2}});
  problem.sigma_mm = 0.02;
  problem.observations[4].p_S_mm *= 1.001;
  const StationNetworkResult result = orient_stations(problem);
  EXPECT_EQ(result.status, StationNetworkStatus::contradiction);
  EXPECT_THAT(result.reason, HasSubstr("no single one explains it"));
  EXPECT_TRUE(result.removed.empty());
}

// An error of eight sigma that four points show but do not always locate: the wrong point is named, or all
// that may be it; a right one alone is accused as rarely as the likelihood ratio of 1000 says.
TEST(StationNetwork, SaysWhichPointsMayBeWrong) {
  Random random(16);
  int removed = 0, open = 0, accused = 0;
  for (int k = 0; k < 400; ++k) {
    StationNetworkProblem problem = problem_of(truth_of(random, 2, 4), {{0, 1, 2, 3}, {0, 1, 2, 3}});
    problem.sigma_mm = 0.03;
    add_noise(random, 0.03, problem);
    problem.observations[5].p_S_mm += 0.24 * test::uniform_rotation(random).col(0);
    const StationNetworkResult result = orient_stations(problem);
    const auto& named = result.status == StationNetworkStatus::ok ? result.removed : result.suspects;
    if (named.empty()) continue;
    accused += std::ranges::count(named, std::size_t(5)) == 0 ? 1 : 0;
    if (result.status == StationNetworkStatus::ok) {
      ++removed;
      continue;
    }
    ++open;
    EXPECT_THAT(result.reason, HasSubstr("wrong is one of: point P"));
  }
  EXPECT_GT(removed, 20);
  EXPECT_GT(open, 20);
  EXPECT_LE(accused, 3);  // 1e-3 of 400 draws: more than three in 1 of 1000 runs
}

// B and C have two points each in common with A, together four: as a group they can be oriented.
TEST(StationNetwork, OrientsAGroup) {
  Random random(12);
  const Truth truth = truth_of(random, 3, 8);
  const StationNetworkResult result =
      orient_stations(problem_of(truth, {{0, 1, 2, 3}, {0, 1, 4, 5, 6}, {2, 3, 4, 5, 6, 7}}));
  ASSERT_EQ(result.status, StationNetworkStatus::ok) << result.reason;
  for (std::size_t s = 0; s < 3; ++s) test::expect_near(result.X_AS[s].X, truth.X_AS[s], 1e-7, 1e-8);
}

StationNetworkResult result_of(const StationNetworkProblem& problem, StationNetworkStatus status,
                               const std::string& words) {
  const StationNetworkResult result = orient_stations(problem);
  EXPECT_EQ(name_of(result.status), name_of(status)) << result.reason;
  EXPECT_THAT(result.reason, HasSubstr(words));
  return result;
}

TEST(StationNetwork, NamesWhatCannotBeOriented) {
  Random random(13);
  const Truth truth = truth_of(random, 3, 11);
  using enum StationNetworkStatus;
  result_of(problem_of(truth, {{0, 1, 2, 3}}), wrong_problem, "1 stations, a network needs 2");
  result_of(problem_of(truth, {{0, 1, 2, 3}, {0, 1, 2, 3}, {5, 6, 7}}), not_connected,
            "station C: no point in common with the other stations");
  result_of(problem_of(truth, {{0, 1, 2, 3}, {0, 1, 2, 3}, {1, 3, 7}}), too_few_points,
            "station C: 2 of 3 points (P1, P3) in common with stations A, B");
  result_of(problem_of(truth, {{0, 1, 2}, {1, 2, 3, 4, 5}, {3, 4, 5}}), too_few_points,
            "stations B, C: 2 of 3 points (P1, P2) in common with station A");
  Truth line = truth;
  for (std::size_t i = 0; i < 4; ++i)
    line.points_A[i] = Vector3d(100, 200, 300) + double(i) * Vector3d(300, 20, 5);
  result_of(problem_of(line, {{0, 1, 2, 3, 4}, {0, 1, 2, 3, 5}}), collinear,
            "station B and station A, points in common: the 4 points lie on a line");
}

TEST(StationNetwork, NamesAnotherUnit) {
  Random random(14);
  StationNetworkProblem problem = problem_of(truth_of(random, 2, 5), {{0, 1, 2, 3, 4}, {0, 1, 2, 3, 4}});
  for (StationObservation& seen : problem.observations)
    if (seen.station == 1) seen.p_S_mm /= 1000;
  result_of(problem, StationNetworkStatus::other_units,
            "1000.000 times as long from station A as from station B");
}

TEST(StationNetwork, NamesWrongNumbers) {
  Random random(15);
  const StationNetworkProblem good = problem_of(truth_of(random, 2, 5), {{0, 1, 2, 3, 4}, {0, 1, 2, 3, 4}});
  StationNetworkProblem bad = good;
  bad.observations[2].p_S_mm.z() = std::nan("");
  result_of(bad, StationNetworkStatus::wrong_problem, "point P2 of station A has a number that is none");
  bad = good;
  bad.observations.push_back(bad.observations[7]);
  result_of(bad, StationNetworkStatus::wrong_problem, "point P2 of station B is there twice");
  bad = good;
  bad.observations[0].sigma_mm = 0.02;
  result_of(bad, StationNetworkStatus::wrong_problem, "1 of 10 observations have a sigma of their own");
  bad = good;
  bad.reference = 2;
  result_of(bad, StationNetworkStatus::wrong_problem, "the reference is no station");
}

}  // namespace
}  // namespace zeropose
