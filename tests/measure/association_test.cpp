// Holes beside marks: the geometry of all marks says which is which, or nothing is said.
#include <gtest/gtest.h>

#include "measure/association.h"
#include "tests/support/cell_scene.h"
#include "tests/support/poses.h"

namespace zeropose {
namespace {

using Eigen::Vector2d;
using test::CellScene;
using test::Random;

struct Choice {
  CellScene scene;
  std::vector<MarkFinding> truth, findings;
  std::vector<std::vector<MarkFinding>> candidates;
};

// Every view found, with noise of 0.02 px, about a random pose.
Choice found_marks(Random& random) {
  Choice choice{test::car_body_points(), {}, {}, {}};
  choice.scene.job.system_sigma_px = 0.05;
  const auto observations = test::observe(choice.scene.cameras, choice.scene.job,
                                          test::random_shift(random, 20, 0.2), 0.02, random);
  EXPECT_EQ(observations.size(), choice.scene.job.views.size());
  for (const Observation& observation : observations) {
    MarkFinding& finding = choice.truth.emplace_back();
    finding.status = MarkStatus::found;
    finding.u_px = observation.u_px;
    finding.covariance_px2 = observation.covariance_px2;
  }
  choice.findings = choice.truth;
  choice.candidates.resize(choice.truth.size());
  return choice;
}

// A second hole at that view, and the finder's doubt.
void add_rival(Choice& choice, std::size_t view, const Vector2d& off_px, bool first) {
  MarkFinding rival = choice.truth[view];
  rival.u_px += off_px;
  choice.candidates[view] = {choice.truth[view], rival};
  if (first) std::swap(choice.candidates[view][0], choice.candidates[view][1]);
  choice.findings[view] = choice.candidates[view][0];
  choice.findings[view].status = MarkStatus::ambiguous;
}

std::vector<MarkFinding> decide(const Choice& choice) {
  return decided_by_geometry(choice.scene.job, choice.scene.cameras, choice.findings, choice.candidates,
                             Pose::Identity());
}

TEST(Association, GeometryTellsTheMarkFromTheHoleBesideIt) {
  Random random(1);
  for (int trial = 0; trial < 20; ++trial) {
    Choice choice = found_marks(random);
    for (const std::size_t view : {1u, 4u, 7u})
      add_rival(choice, view, {test::uniform(random, 8, 40), test::uniform(random, -40, 40)}, trial % 2 == 0);
    const auto decided = decide(choice);
    for (std::size_t view = 0; view < decided.size(); ++view) {
      EXPECT_EQ(decided[view].status, MarkStatus::found);
      EXPECT_EQ(decided[view].u_px, choice.truth[view].u_px);
    }
  }
}

// All marks of the only camera moved alike explain another pose as well as the right ones explain theirs.
TEST(Association, WhatTwoPosesExplainStaysAmbiguous) {
  Random random(2);
  Choice choice = found_marks(random);
  const std::size_t camera = choice.scene.job.views[0].camera;
  std::vector<View> views;
  std::vector<MarkFinding> truth;
  for (std::size_t i = 0; i < choice.truth.size(); ++i)
    if (choice.scene.job.views[i].camera == camera) {
      views.push_back(choice.scene.job.views[i]);
      truth.push_back(choice.truth[i]);
    }
  choice.scene.job.views = views;
  choice.truth = choice.findings = truth;
  choice.candidates.assign(truth.size(), {});
  for (std::size_t view = 0; view < truth.size(); ++view) add_rival(choice, view, {20, 0}, false);
  for (const MarkFinding& finding : decide(choice)) EXPECT_EQ(finding.status, MarkStatus::ambiguous);
}

TEST(Association, ARivalNextToItStaysAmbiguous) {
  Random random(3);
  Choice choice = found_marks(random);
  add_rival(choice, 2, {0.1, 0}, false);  // within what calibration leaves open
  EXPECT_EQ(decide(choice)[2].status, MarkStatus::ambiguous);
}

// Another mark is wrong: no choice fits, and none is made.
TEST(Association, NoChoiceIsMadeWhereNoneFits) {
  Random random(4);
  Choice choice = found_marks(random);
  add_rival(choice, 2, {20, 10}, false);
  choice.findings[5].u_px += Vector2d(10, -6);
  EXPECT_EQ(decide(choice)[2].status, MarkStatus::ambiguous);
}

}  // namespace
}  // namespace zeropose
