#include "sim/plates_look.h"

namespace zeropose {

PlatesLook::PlatesLook(const Scene& scene, std::size_t camera) : backdrop_(make_backdrop(scene, camera)) {}

void PlatesLook::paint(Canvas& canvas, const Moment& moment) const {
  canvas.clear(backdrop_.hall_grey);
  for (const Sheet& sheet : backdrop_.behind) canvas.paint(sheet, moment.X_CnCo);
  for (const Sheet& sheet : backdrop_.on_object) canvas.paint(sheet, moment.X_CO);
  for (const MarkPlate& plate : backdrop_.plates) paint_plate(canvas, plate, moment.X_CO, moment);
  for (const Sheet& sheet : backdrop_.in_front) canvas.paint(sheet, moment.X_CnCo);
}

}  // namespace zeropose
