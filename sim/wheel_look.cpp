#include "sim/wheel_look.h"

#include <cmath>

#include "sim/random.h"

namespace zeropose {
namespace {

constexpr int spots = 6;
constexpr double spot_mm = 7;  // radius, at most

// Mud within what the sensor sees of the side wall.
void add_dirt(std::vector<TyreStain>& stains, const TyreShape& tyre, double angle_rad, std::uint64_t number) {
  Random random(number);
  const Eigen::Vector2d outwards(std::cos(angle_rad), std::sin(angle_rad)),
      right(outwards.y(), -outwards.x());
  for (int spot = 0; spot < spots; ++spot) {
    TyreStain stain;
    stain.centre_mm =
        random.uniform(tyre.bead_mm, tyre.tread_mm) * outwards + random.uniform(-50, 50) * right;
    stain.radius_mm = random.uniform(0.1 * spot_mm, spot_mm);
    stains.push_back(stain);
  }
}

}  // namespace

WheelLook::WheelLook(const WheelObject& object, const Scene& scene, std::size_t camera)
    : object_(object), camera_(camera), blur_sigma_px_(scene.picture.blur_sigma_px) {
  Random lamps(scene.picture.seed * 1000 + camera);
  light_ = drawn_light(scene.cameras.at(camera).model, scene.picture.illumination_gradient, lamps);
}

void WheelLook::paint(Canvas& canvas, const Moment& moment) const {
  TyreScene scene;
  const Pose X_WC = moment.X_CW.inverse();
  scene.tyre = object_.tyre;
  scene.X_WO = X_WC * moment.X_CO * Eigen::Translation3d(0, 0, -object_.profile_mm);
  scene.blur_sigma_px = blur_sigma_px_;
  for (const WheelSensorTruth& sensor : object_.sensors)
    if (camera_ == sensor.left || camera_ == sensor.right) scene.projector = sensor.projector;
  for (const std::string& text : moment.faults.covered) {
    const auto fault = wheel_fault(object_, text);
    if (!fault) continue;
    const WheelSensorTruth& sensor = object_.sensors[fault->sensor];
    if (fault->kind == "dirt")
      add_dirt(scene.stains, object_.tyre, sensor.angle_rad, fault->number);
    else if (camera_ == sensor.left || camera_ == sensor.right)
      scene.projector.lines[fault->number - 1].brightness = 0;
  }
  canvas.show(tyre_picture(scene, canvas.rays(), X_WC));
}

}  // namespace zeropose
