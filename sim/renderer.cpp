#include "sim/renderer.h"

#include <cassert>

#include "sim/disc_image.h"

namespace zeropose {

CameraRenderer::CameraRenderer(const Scene& scene, std::size_t camera)
    : rays_(scene.cameras.at(camera).model),
      name_(scene.cameras.at(camera).name),
      X_CW_(scene.cameras.at(camera).X_WC.inverse()),
      backdrop_(make_backdrop(scene, camera)),
      blur_sigma_px_(scene.picture.blur_sigma_px) {}

CameraRenderer::Placed CameraRenderer::place(const MarkPlate& plate, const Pose& X_CO,
                                             const Faults& faults) const {
  Placed placed{X_CO * plate.X_OM, faults.covered.contains(plate.name)};
  const auto displaced = faults.displaced_px.find(plate.name);
  if (displaced == faults.displaced_px.end()) return placed;
  const double depth = placed.X_CM.translation().z();
  const auto u_px = project(rays_.camera(), placed.X_CM.translation());
  if (!u_px) return placed;
  const auto moved_ray = ray(rays_.camera(), *u_px + Eigen::Vector2d(displaced->second, 0));
  if (moved_ray) placed.X_CM.translation() = depth * *moved_ray;
  return placed;
}

std::vector<float> CameraRenderer::clean_picture(const Pose& X_WO, const Faults& faults) const {
  const CameraModel& camera = rays_.camera();
  std::vector<float> picture(
      static_cast<std::size_t>(camera.width_px) * static_cast<std::size_t>(camera.height_px),
      static_cast<float>(backdrop_.hall_grey));
  Painter painter(rays_, blur_sigma_px_, picture);
  const auto moved = faults.moved_cameras.find(name_);
  const Pose X_CnCo = moved == faults.moved_cameras.end() ? Pose::Identity() : moved->second.inverse();
  const Pose X_CW = X_CnCo * X_CW_, X_CO = X_CW * X_WO;
  for (const Sheet& sheet : backdrop_.behind) painter.paint(sheet, X_CnCo);
  for (const Sheet& sheet : backdrop_.on_object) painter.paint(sheet, X_CO);
  std::vector<std::pair<const MarkPlate*, Placed>> plates;
  for (const MarkPlate& plate : backdrop_.plates) plates.emplace_back(&plate, place(plate, X_CO, faults));
  for (const MarkPlate& plate : backdrop_.fixed_plates)
    plates.emplace_back(&plate, place(plate, X_CW, faults));
  for (const auto& [plate, placed] : plates) {
    painter.paint({Pose::Identity(), plate->things}, placed.X_CM);
    if (placed.covered) painter.paint({Pose::Identity(), plate->cover}, placed.X_CM);
  }
  for (const Sheet& sheet : backdrop_.in_front) painter.paint(sheet, X_CnCo);
  painter.illuminate(backdrop_.light);
  for (const auto& [plate, placed] : plates) {
    if (placed.covered) continue;
    render_disc(camera, {placed.X_CM, plate->radius_mm, plate->mark_grey, plate->surface_grey},
                backdrop_.light, blur_sigma_px_, picture);
  }
  return picture;
}

}  // namespace zeropose
