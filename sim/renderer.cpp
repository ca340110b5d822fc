#include "sim/renderer.h"

namespace zeropose {

CameraRenderer::CameraRenderer(const Scene& scene, std::size_t camera)
    : rays_(scene.cameras.at(camera).model),
      name_(scene.cameras.at(camera).name),
      X_CW_(scene.cameras.at(camera).X_WC.inverse()),
      look_(make_look(scene, camera)),
      references_(reference_plates(scene, camera)),
      blur_sigma_px_(scene.picture.blur_sigma_px) {}

std::vector<float> CameraRenderer::clean_picture(const Pose& X_WO, const Faults& faults,
                                                 const std::optional<Carried>& carried) const {
  const auto moved = faults.moved_cameras.find(name_);
  const Pose X_CnCo = moved == faults.moved_cameras.end() ? Pose::Identity() : moved->second.inverse();
  const Pose X_CW = X_CnCo * X_CW_;
  const auto* pane = carried ? std::get_if<CarriedPane>(&*carried) : nullptr;
  const auto X_CT = pane != nullptr ? std::optional<Pose>(X_CW * pane->X_WT) : std::nullopt;
  const Moment moment{X_CW, X_CW * X_WO, X_CnCo, faults, X_CT};
  Canvas canvas(rays_, blur_sigma_px_, 0);
  look_->paint(canvas, moment);
  for (const MarkPlate& plate : references_) paint_plate(canvas, plate, X_CW, moment);
  if (carried) paint_carried(canvas, *carried, X_CW);
  canvas.illuminate(look_->light());
  return std::move(canvas).picture();
}

}  // namespace zeropose
