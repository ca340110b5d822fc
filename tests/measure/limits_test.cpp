// Every limit at its edge (spec 85 R18): the limit itself passes, one digit of the wire beyond does not, nor
// do numbers that are none.
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>

#include "measure/security.h"

namespace zeropose {
namespace {

constexpr double mm_digit = 1e-3, deg_digit = 1e-4;  // of the wire
constexpr double nan = std::numeric_limits<double>::quiet_NaN();
constexpr double inf = std::numeric_limits<double>::infinity();
constexpr double radius_mm = 3000;

struct Edge {
  const char* name;
  double limit, digit;
  bool both_signs;
  Code code;
  Code code_of_none;  // for NaN and infinity; of a rotation that is none ry speaks
  std::function<Verdict(double)> check;
};

Pose six(double x, double y, double z, double rx, double ry, double rz) {
  return from_six_numbers({x, y, z, rx, ry, rz});
}

Requirements ranges() {
  Requirements requirements;
  for (std::size_t i = 0; i < 6; ++i) requirements.limits[i] = i < 3 ? Range{-40, 40} : Range{-0.5, 0.5};
  return requirements;
}

Job job_with_points() {
  Job job;
  job.application_points = {{"near", {300, -200, 100}}, {"far", {radius_mm, 0, 0}}};
  job.requirements.max_displacement_mm = 40;
  job.requirements.max_step_mm = 15;
  job.requirements.max_step_deg = 0.25;
  return job;
}

// By a length in a direction that is none of the axes.
Pose slid(const Pose& X_O0O, double length_mm) {
  Pose moved = X_O0O;
  moved.translation() += length_mm * Eigen::Vector3d(0.6, 0, -0.8);
  return moved;
}

// A turn about z that carries the far point over a chord of that length.
Pose turned_by_chord(double chord_mm) {
  return six(0, 0, 0, 0, 0, 2 * std::asin(chord_mm / (2 * radius_mm)) * degrees_per_radian);
}

const Pose last = six(12, -7, 3, 0.2, -0.1, 0.3);
const Pose first = Pose::Identity();

Edge axis(const char* name, double limit, double digit, Code code, Code code_of_none,
          std::function<Pose(double)> pose) {
  return {name, limit, digit, true, code, code_of_none, [pose = std::move(pose)](double value) {
            return check_limits(ranges(), pose(value));
          }};
}

Edge length(const char* name, double limit, Code code, std::function<Verdict(double)> check) {
  return {name, limit, mm_digit, false, code, code, std::move(check)};
}

std::vector<Edge> edges() {
  const Code rx = Code::limit_rx, none = Code::limit_ry;
  return {
      axis("x", 40, mm_digit, Code::limit_x, Code::limit_x, [](double v) { return six(v, 0, 0, 0, 0, 0); }),
      axis("y", 40, mm_digit, Code::limit_y, Code::limit_y, [](double v) { return six(0, v, 0, 0, 0, 0); }),
      axis("z", 40, mm_digit, Code::limit_z, Code::limit_z, [](double v) { return six(0, 0, v, 0, 0, 0); }),
      axis("rx", 0.5, deg_digit, rx, none, [](double v) { return six(0, 0, 0, v, 0.3, -0.4); }),
      axis("ry", 0.5, deg_digit, Code::limit_ry, none, [](double v) { return six(0, 0, 0, 0.3, v, -0.4); }),
      axis("rz", 0.5, deg_digit, Code::limit_rz, none, [](double v) { return six(0, 0, 0, 0.3, -0.4, v); }),
      length("displacement_by_a_shift", 40, Code::limit_displacement,
             [](double v) { return check_displacement(job_with_points(), slid(first, v)); }),
      length("displacement_by_a_turn", 40, Code::limit_displacement,
             [](double v) { return check_displacement(job_with_points(), turned_by_chord(v)); }),
      length("step_by_a_shift", 15, Code::step_too_large,
             [](double v) { return check_step(job_with_points(), last, slid(last, v)); }),
      length("step_by_a_turn", 10, Code::step_too_large,
             [](double v) {
               Job job = job_with_points();
               job.requirements.max_step_mm = 10;
               return check_step(job, last, last * turned_by_chord(v));
             }),
      {"step_of_the_angle", 0.25, deg_digit, false, Code::step_too_large, Code::step_too_large,
       [](double v) {
         const Eigen::Vector3d about = Eigen::Vector3d(2, -1, 2).normalized();
         Job job = job_with_points();
         job.requirements.max_step_mm = 0;
         return check_step(job, last, last * Pose(Eigen::AngleAxisd(v / degrees_per_radian, about)));
       }},
  };
}

class LimitEdges : public testing::TestWithParam<Edge> {};

TEST_P(LimitEdges, AreExact) {
  const Edge& edge = GetParam();
  for (const double sign : {1.0, -1.0}) {
    if (sign < 0 && !edge.both_signs) continue;
    EXPECT_EQ(edge.check(sign * (edge.limit - edge.digit)).code, Code::ok);
    EXPECT_EQ(edge.check(sign * edge.limit).code, Code::ok) << edge.check(sign * edge.limit).reason;
    const Verdict beyond = edge.check(sign * (edge.limit + edge.digit));
    EXPECT_EQ(beyond.code, edge.code);
    EXPECT_FALSE(beyond.reason.empty());
    EXPECT_EQ(edge.check(sign * inf).code, edge.code_of_none);
  }
  EXPECT_EQ(edge.check(0).code, Code::ok);
  EXPECT_EQ(edge.check(nan).code, edge.code_of_none);
}

INSTANTIATE_TEST_SUITE_P(All, LimitEdges, testing::ValuesIn(edges()),
                         [](const auto& edge) { return std::string(edge.param.name); });

TEST(Displacement, NamesTheWorstPointAndIsOffWithoutALimit) {
  Job job = job_with_points();
  const Pose X_O0O = turned_by_chord(45.5);
  const Verdict verdict = check_displacement(job, X_O0O);
  EXPECT_EQ(verdict.reason, "far is displaced by 45.500 mm, allowed are 40.000 mm");
  job.requirements.max_displacement_mm = 0;
  EXPECT_EQ(check_displacement(job, X_O0O).code, Code::ok);
}

TEST(Displacement, IsThatOfTheMarksWithoutApplicationPoints) {
  Job job = job_with_points();
  job.application_points.clear();
  job.marks.resize(2);
  job.marks[1].name = "hole";
  job.marks[1].p_O_mm = {radius_mm, 0, 0};
  const Verdict verdict = check_displacement(job, turned_by_chord(41));
  EXPECT_EQ(verdict.reason, "hole is displaced by 41.000 mm, allowed are 40.000 mm");
}

// One that is none must not hide behind those after it.
TEST(Displacement, OfAPointThatIsNoneIsRefusedWhereverItStands) {
  for (const std::size_t bad : {0u, 1u}) {
    Job job = job_with_points();
    job.application_points[bad].p_O_mm.x() = nan;
    EXPECT_EQ(check_displacement(job, six(1, 0, 0, 0, 0, 0)).code, Code::limit_displacement);
  }
}

TEST(Step, SaysWhichPointOrAngleAndIsOffWithoutALimit) {
  Job job = job_with_points();
  EXPECT_EQ(check_step(job, last, last * turned_by_chord(15.25)).reason,
            "far is 15.250 mm from where the last valid result put it, allowed are 15.000 mm");
  const Pose turned = last * six(0, 0, 0, 0, 0, -0.26);
  EXPECT_EQ(
      check_step(job, last, turned).reason,
      "the object is turned by 0.2600 deg from where the last valid result put it, allowed are 0.2500 deg");
  job.requirements.max_step_deg = 0;
  EXPECT_EQ(check_step(job, last, turned).code, Code::ok);
  job.requirements.max_step_mm = 0;
  EXPECT_EQ(check_step(job, last, six(500, 0, 0, 0, 0, 90)).code, Code::ok);
}

}  // namespace
}  // namespace zeropose
