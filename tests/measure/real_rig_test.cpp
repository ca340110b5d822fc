// A photographed sheet of 100 marks as the object, four published views of it as a rig: the pose must be the
// identity (../shared/data/real/dbat_camcal/README.md, "multi-camera use").
#include <gtest/gtest.h>

#include <array>
#include <functional>
#include <map>

#include "measure/pose.h"
#include "tests/support/csv.h"
#include "tests/support/photogrammetric_pose.h"
#include "tests/support/poses.h"
#include "tests/support/shared_data.h"

namespace zeropose {
namespace {

using Eigen::Vector3d;
using test::CsvTable;
using Views = std::array<int, 4>;

// The body's frame is in the middle of the sheet: there the published shifts are given.
const Vector3d middle_mm(500, 500, 0);

constexpr Views sets[] = {{1, 5, 9, 13}, {2, 6, 10, 14}, {3, 7, 11, 15}, {4, 8, 12, 21}};

// OpenCV's calibration of these views. Pixels and image origin count from the corner of the first pixel.
const CameraModel olympus{2272,
                          1704,
                          2336.160,
                          2337.067,
                          1132.887 - 0.5,
                          818.973 - 0.5,
                          BrownConrady{-0.252555, 0.293910, -0.000266, 0.000381, 0}};

struct Sheet {
  std::vector<Mark> marks;
  std::map<int, std::vector<Observation>> seen;  // by view; the camera is not set
  std::map<int, Pose> poses;

  Sheet(const CsvTable& points, const CsvTable& published) {
    std::map<std::string, std::size_t> index;
    for (std::size_t row = 0; row < points.size(); ++row) {
      const auto [found, added] = index.emplace(points.text(row, "id"), marks.size());
      if (added) {
        marks.emplace_back().name = found->first;
        marks.back().p_O_mm = {points.number(row, "x_mm"), points.number(row, "y_mm"),
                               points.number(row, "z_mm")};
        marks.back().p_O_mm -= middle_mm;
      }
      const Eigen::Vector2d u(points.number(row, "u_px") - 0.5, points.number(row, "v_px") - 0.5);
      seen[static_cast<int>(points.number(row, "view"))].push_back(
          {0, found->second, u, 0.15 * 0.15 * Eigen::Matrix2d::Identity()});
    }
    for (std::size_t row = 0; row < published.size(); ++row)
      poses[static_cast<int>(published.number(row, "view"))] = test::photogrammetric_pose(published, row);
  }

  // The pose of the sheet from four views, each with the marks for which `uses` says so.
  PoseResult pose(const Views& views,
                  const std::function<bool(std::size_t camera, const Vector3d&)>& uses) const {
    std::vector<CalibratedCamera> rig;
    std::vector<Observation> observations;
    for (std::size_t camera = 0; camera < views.size(); ++camera) {
      rig.push_back({"view" + std::to_string(views[camera]), olympus, poses.at(views[camera])});
      for (Observation observation : seen.at(views[camera])) {
        if (!uses(camera, marks[observation.mark].p_O_mm)) continue;
        observation.camera = camera;
        observations.push_back(observation);
      }
    }
    PoseProblem problem;
    problem.cameras = rig;
    problem.marks = marks;
    problem.observations = observations;
    problem.X_WO_start = Pose(Eigen::Translation3d(middle_mm));
    problem.reject_wrong_marks = false;
    return estimate_pose(problem);
  }
};

std::optional<Sheet> sheet() {
  const auto points = test::shared_data("real/dbat_camcal/points.csv"),
             poses = test::shared_data("real/dbat_camcal/reference_eo_dbat.csv");
  if (!points || !poses) return std::nullopt;
  return Sheet(CsvTable(*points), CsvTable(*poses));
}

void expect_identity(const PoseResult& result, double mm, double deg) {
  ASSERT_EQ(result.code, Code::ok) << result.reason;
  const Pose X_OO = Pose(Eigen::Translation3d(-middle_mm)) * result.X_WO;
  const Vector3d p = X_OO.translation();
  double squares = 0;
  for (const Deviation& deviation : result.deviations) squares += deviation.dev_px.squaredNorm();
  std::printf("%zu observations: %.5f deg, (%.3f %.3f %.3f) mm, RMS %.3f px\n", result.deviations.size(),
              test::angle_deg(X_OO, Pose::Identity()), p.x(), p.y(), p.z(),
              std::sqrt(squares / static_cast<double>(result.deviations.size())));
  test::expect_near(X_OO, Pose::Identity(), mm, deg);
}

TEST(RealRig, OfFourViewsFindsTheSheetWhereItIs) {
  const auto given = sheet();
  if (!given) GTEST_SKIP() << test::data_not_found;
  for (const Views& views : sets)
    expect_identity(given->pose(views, [](std::size_t, const Vector3d&) { return true; }), 0.15, 0.005);
}

// As in a car body cell: no camera sees what another one sees.
TEST(RealRig, OfFourViewsThatShareNoMarkFindsTheSheetWhereItIs) {
  const auto given = sheet();
  if (!given) GTEST_SKIP() << test::data_not_found;
  const auto own_quadrant = [](std::size_t camera, const Vector3d& p_O) {
    return (p_O.x() > 0) == (camera % 2 == 1) && (p_O.y() > 0) == (camera >= 2);
  };
  for (const Views& views : sets) expect_identity(given->pose(views, own_quadrant), 0.15, 0.03);
}

}  // namespace
}  // namespace zeropose
