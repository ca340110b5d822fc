// find_marks() on 21 real photographs of 100 round marks, by a consumer camera that sharpens and compresses,
// against the centroids that another program measured (dbat, PhotoModeler), and what a bundle makes of both.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <iterator>
#include <map>
#include <opencv2/imgcodecs.hpp>
#include <optional>

#include "calib/views.h"
#include "measure/marks.h"
#include "tests/support/csv.h"
#include "tests/support/shared_data.h"

namespace zeropose {
namespace {

using Eigen::Vector2d;

// One listed mark in one photograph.
struct Listed {
  int view = 0, id = 0;
  Eigen::Vector3d p_B_mm = Eigen::Vector3d::Zero();
  Vector2d u_px = Vector2d::Zero();  // theirs, the centre of the first pixel at (0, 0)
  MarkFinding ours{};
};

struct Photographs {
  std::vector<Listed> marks;
  std::map<int, cv::Mat> grey;  // by view

  ImageView view(int number) const {
    const cv::Mat& picture = grey.at(number);
    return {picture.data, picture.cols, picture.rows, static_cast<std::ptrdiff_t>(picture.step)};
  }
};

// Their pixel origin is the corner of the first pixel.
std::optional<Photographs> photographs() {
  const auto file = test::shared_data("real/dbat_camcal/points.csv");
  if (!file) return std::nullopt;
  Photographs all;
  const test::CsvTable table(*file);
  for (std::size_t row = 0; row < table.size(); ++row) {
    const auto number = [&](const char* column) { return table.number(row, column); };
    all.marks.push_back({static_cast<int>(number("view")),
                         static_cast<int>(number("id")),
                         {number("x_mm"), number("y_mm"), number("z_mm")},
                         {number("u_px") - 0.5, number("v_px") - 0.5},
                         {}});
  }
  for (int view = 1; view <= 21; ++view) {
    const auto picture =
        test::shared_data("real/dbat_camcal/images/P82500" + std::to_string(20 + view) + ".JPG");
    if (!picture) return std::nullopt;
    all.grey[view] = cv::imread(*picture, cv::IMREAD_GRAYSCALE);
  }
  return all;
}

// The marks are printed black on white, 20..50 px in these pictures; the photographs are oblique.
MarkSearch search_at(const Vector2d& expected_px, double half_window_px) {
  MarkSearch search;
  search.expected_px = expected_px;
  search.half_window_px = Vector2d::Constant(half_window_px);
  search.min_diameter_px = 14, search.max_diameter_px = 64;
  search.min_axis_ratio = 0.3;
  return search;
}

void find_all(Photographs& all) {
  for (int view = 1; view <= 21; ++view) {
    std::vector<MarkSearch> searches;
    std::vector<Listed*> wanted;
    for (Listed& mark : all.marks) {
      if (mark.view != view) continue;
      searches.push_back(search_at(mark.u_px, 45));
      wanted.push_back(&mark);
    }
    const std::vector<MarkFinding> findings = find_marks(all.view(view), searches);
    for (std::size_t k = 0; k < wanted.size(); ++k) wanted[k]->ours = findings[k];
  }
}

// Read and searched once for all tests.
const std::optional<Photographs>& searched() {
  static const std::optional<Photographs> all = [] {
    auto read = photographs();
    if (read) find_all(*read);
    return read;
  }();
  return all;
}

std::vector<Listed> found_marks(const Photographs& all) {
  std::vector<Listed> found;
  std::copy_if(all.marks.begin(), all.marks.end(), std::back_inserter(found),
               [](const Listed& mark) { return mark.ours.status == MarkStatus::found; });
  return found;
}

void print_reasons(const Photographs& all) {
  std::map<std::string_view, int> reasons;
  for (const Listed& mark : all.marks) ++reasons[name_of(mark.ours.status)];
  for (const auto& [reason, count] : reasons) std::printf("%s %d\n", reason.data(), count);
}

constexpr std::size_t least_found = 2054;  // 99 % of 2074

// Ours less theirs along one axis.
struct Difference {
  double mean_px = 0, rms_px = 0;                              // rms about the mean
  double middle_px = 0, scale = 0, rest_px = 0, worst_px = 0;  // line along the axis through the picture's
                                                               // middle, and what remains beside it
};

Difference difference_along(int axis, const std::vector<Listed>& marks) {
  const auto count = static_cast<Eigen::Index>(marks.size());
  Eigen::ArrayXd place(count), off(count);
  for (Eigen::Index k = 0; k < count; ++k) {
    const Listed& mark = marks[static_cast<std::size_t>(k)];
    place(k) = mark.u_px[axis] - (axis == 0 ? 1135.5 : 851.5);
    off(k) = mark.ours.u_px[axis] - mark.u_px[axis];
  }
  Difference result;
  result.mean_px = off.mean();
  result.rms_px = std::sqrt((off - off.mean()).square().mean());
  const Eigen::ArrayXd far = place - place.mean();
  result.scale = (far * off).sum() / far.square().sum();
  result.middle_px = off.mean() - result.scale * place.mean();
  const Eigen::ArrayXd rest = off - result.middle_px - result.scale * place;
  result.rest_px = std::sqrt(rest.square().mean());
  result.worst_px = rest.abs().maxCoeff();
  return result;
}

// Their picture is half a pixel narrower and lower than ours, all in all, which the bundle takes up as focal
// lengths: a scale per axis of 2.4e-4 and 3.3e-4. Beside it the two programs agree to 0.05 px.
TEST(MarksReal, AreFoundWhereAnotherProgramFoundThem) {
  if (!searched()) GTEST_SKIP() << test::data_not_found;
  const std::vector<Listed> found = found_marks(*searched());
  print_reasons(*searched());
  EXPECT_GE(found.size(), least_found);
  for (const int axis : {0, 1}) {
    const Difference off = difference_along(axis, found);
    std::printf(
        "%c: %zu found, mean offset %.4f px, rms %.4f px; scale %.2e, rms beside it %.4f, worst %.3f px\n",
        "uv"[axis], found.size(), off.mean_px, off.rms_px, off.scale, off.rest_px, off.worst_px);
    EXPECT_LE(off.rms_px, 0.2);
    EXPECT_LE(std::abs(off.middle_px), 0.02);
    EXPECT_LE(off.rest_px, 0.07);
    EXPECT_LE(off.worst_px, 0.7);
  }
}

ViewsResult bundle_over(const std::vector<Listed>& marks, bool ours) {
  ViewsCamera camera;
  camera.name = "camera", camera.width_px = 2272, camera.height_px = 1704;
  camera.lens = LensModel::brown, camera.fixed = {Parameter::k3};
  std::vector<BoardView> views(21);
  for (std::size_t k = 0; k < views.size(); ++k) views[k].name = std::to_string(k + 1);
  std::vector<ViewPoint> points;
  for (const Listed& mark : marks) {
    ViewPoint seen{static_cast<std::size_t>(mark.view - 1), 0, {}};
    seen.point.p_W_mm = mark.p_B_mm, seen.point.u_px = ours ? mark.ours.u_px : mark.u_px;
    points.push_back(seen);
  }
  ViewsProblem problem;
  problem.cameras = {&camera, 1}, problem.views = views, problem.points = points;
  return calibrate_views(problem);
}

// The same observations, the same model; only who measured them differs. An rms over n points of two
// coordinates is itself known to 1 / sqrt(4 n): 1.3 %.
TEST(MarksReal, ABundleFitsThemNoWorseThanAnotherPrograms) {
  if (!searched()) GTEST_SKIP() << test::data_not_found;
  const std::vector<Listed> found = found_marks(*searched());
  const ViewsResult theirs = bundle_over(found, false), ours = bundle_over(found, true);
  ASSERT_EQ(theirs.status, CalibrationStatus::ok) << theirs.reason;
  ASSERT_EQ(ours.status, CalibrationStatus::ok) << ours.reason;
  std::printf("bundle over %zu marks: theirs %.5f, ours %.5f px rms\n", found.size(), theirs.rms_px,
              ours.rms_px);
  EXPECT_LE(ours.rms_px, theirs.rms_px * (1 + 1 / std::sqrt(4 * double(found.size()))));
}

// A window of the whole photograph holds a hundred of them: none of them is the one that is sought.
TEST(MarksReal, AWholePhotographIsAmbiguous) {
  if (!searched()) GTEST_SKIP() << test::data_not_found;
  const ImageView view = searched()->view(6);
  MarkSearch search = search_at({0.5 * (view.width_px - 1), 0.5 * (view.height_px - 1)}, 0);
  search.half_window_px = search.expected_px;
  EXPECT_EQ(find_marks(view, {&search, 1}).front().status, MarkStatus::ambiguous);
}

}  // namespace
}  // namespace zeropose
