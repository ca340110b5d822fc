#include "sim/look.h"

#include "sim/ball_plate_look.h"
#include "sim/gap_look.h"
#include "sim/plates_look.h"
#include "sim/steel_sheet_look.h"
#include "sim/wheel_look.h"

namespace zeropose {
namespace {

std::unique_ptr<const Look> look_of(const PlatesObject&, const Scene& scene, std::size_t camera) {
  return std::make_unique<PlatesLook>(scene, camera);
}

std::unique_ptr<const Look> look_of(const SheetObject& sheet, const Scene& scene, std::size_t camera) {
  return std::make_unique<SteelSheetLook>(sheet, scene, camera);
}

std::unique_ptr<const Look> look_of(const BallPlateObject& plate, const Scene& scene, std::size_t camera) {
  return std::make_unique<BallPlateLook>(plate, scene, camera);
}

std::unique_ptr<const Look> look_of(const GapsObject& gaps, const Scene& scene, std::size_t camera) {
  return std::make_unique<GapLook>(gaps, scene, camera);
}

std::unique_ptr<const Look> look_of(const WheelObject& wheel, const Scene& scene, std::size_t camera) {
  return std::make_unique<WheelLook>(wheel, scene, camera);
}

}  // namespace

Pose Moment::placed(const std::string& mark, const CameraModel& camera, const Pose& X_CM) const {
  const auto displaced = faults.displaced_px.find(mark);
  if (displaced == faults.displaced_px.end()) return X_CM;
  const auto u_px = project(camera, X_CM.translation());
  const auto moved_ray =
      u_px ? ray(camera, *u_px + Eigen::Vector2d(displaced->second, 0)) : std::optional<Eigen::Vector3d>();
  Pose moved = X_CM;
  if (moved_ray) moved.translation() = X_CM.translation().z() * *moved_ray;
  return moved;
}

std::unique_ptr<const Look> make_look(const Scene& scene, std::size_t camera) {
  return std::visit([&](const auto& object) { return look_of(object, scene, camera); }, scene.object);
}

}  // namespace zeropose
