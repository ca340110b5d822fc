// Draws docs/images/wheel-lines.png, what a camera of a wheel's sensor sees and what was found in it, and
// prints what was measured: wheel_picture FOLDER [camber toe [tyre [camera]]].
#include <algorithm>
#include <cstdlib>
#include <iostream>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "tests/measure/wheel_scene.h"

namespace {

using namespace zeropose;
using namespace zeropose::test;

const cv::Vec3b radial_colour(60, 220, 60), across_colour(240, 150, 30);
const cv::Scalar crossing_colour(60, 160, 255), profile_colour(90, 90, 255);
const cv::Rect shown(200, 120, 360, 320);

// Twice as bright as it is, for the tyre is dark, and in coarse steps, for the file's size.
cv::Mat coloured(const ImageView& image) {
  cv::Mat grey(image.height_px, image.width_px, CV_8UC1), picture;
  for (int v = 0; v < image.height_px; ++v)
    for (int u = 0; u < image.width_px; ++u)
      grey.at<std::uint8_t>(v, u) = cv::saturate_cast<std::uint8_t>(2 * image.grey_at(u, v)) & 0xF8;
  cv::cvtColor(grey, picture, cv::COLOR_GRAY2BGR);
  return picture;
}

void dot(cv::Mat& picture, const Eigen::Vector2d& u_px, int radius, const cv::Scalar& colour) {
  const cv::Point at(cv::saturate_cast<int>(16 * u_px.x()), cv::saturate_cast<int>(16 * u_px.y()));
  cv::circle(picture, at, radius * 16, colour, 1, cv::LINE_AA, 4);
}

cv::Mat with_findings(cv::Mat picture, const LineArrayResult& array, const CalibratedCamera& camera,
                      const SharedProfile& profile) {
  for (const LightLine& line : array.found) {
    const bool upright = line.course == LineCourse::upright;
    for (const LineCentre& c : line.centres) {
      const int at = cvRound(c.at);
      const int place = std::clamp(cvRound(c.place), 0, (upright ? picture.cols : picture.rows) - 1);
      picture.at<cv::Vec3b>(upright ? at : place, upright ? place : at) =
          upright ? radial_colour : across_colour;
    }
  }
  for (const auto& row : array.crossings)
    for (const auto& crossing : row)
      if (crossing) dot(picture, *crossing, 6, crossing_colour);
  for (const ProfileExtreme& extreme : profile) {
    const auto u = project(camera.model, camera.X_WC.inverse() * extreme.p_W_mm);
    if (u && in_image(camera.model, *u)) dot(picture, *u, 5, profile_colour);
  }
  return picture;
}

void print(const WheelResult& result) {
  std::cout << name_of(result.status) << " " << result.reason << "\ncamber "
            << result.camber_rad * degrees_per_radian << " toe " << result.toe_rad * degrees_per_radian
            << " sigma " << result.sigma_camber_rad * degrees_per_radian << " deg, radius "
            << result.profile_radius_mm << " mm, the whole side wall differs by "
            << result.surface_differs_rad * degrees_per_radian << " deg\n";
  for (std::size_t i = 0; i < result.plane.off_plane_mm.size(); ++i)
    std::cout << "  " << result.plane.off_plane_mm[i] << " mm off the plane (sigma "
              << result.profile[i].sigma_mm << "), " << result.plane.off_circle_mm[i]
              << " mm off the circle (sigma " << result.profile[i].sigma_radius_mm << ")\n";
}

}  // namespace

int main(int argc, char** argv) {
  const auto given = [&](int i, double otherwise) { return argc > i ? std::atof(argv[i]) : otherwise; };
  const std::string folder = argc > 1 ? argv[1] : ".";
  const auto tyre = static_cast<std::size_t>(given(4, 1)), c = static_cast<std::size_t>(given(5, 2));
  if (tyre >= example_tyres().size() || c >= wheel_cameras) return 2;
  const WheelCell cell = wheel_cell(example_tyres()[tyre]);
  std::uint64_t noise = 1;
  const WheelPictures pictures = exposed(rendered(cell, tilted_wheel(given(2, -1), given(3, 1))), noise);
  const WheelResult result = measured(cell, pictures);
  print(result);
  LineArrayProblem problem;
  const WheelSensor sensor = sensors_of(cell, pictures)[c / 2];
  problem.image = c % 2 == 0 ? sensor.left_image : sensor.right_image;
  const cv::Mat seen = coloured(problem.image);
  const cv::Mat found = with_findings(seen.clone(), order_lines(problem), cell.believed[c], result.profile);
  cv::Mat both;
  cv::hconcat(seen(shown), found(shown), both);
  cv::imwrite(folder + "/wheel-lines.png", both, {cv::IMWRITE_PNG_COMPRESSION, 9});
}
