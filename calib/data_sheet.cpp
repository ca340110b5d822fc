#include "calib/data_sheet.h"

namespace zeropose {

DataSheet data_sheet(const CameraModel& camera, double sy_mm) {
  DataSheet sheet;
  sheet.f_mm = sy_mm * camera.fy_px;
  sheet.sy_mm = sy_mm;
  sheet.sx_mm = sheet.f_mm / camera.fx_px;
  if (const auto* lens = std::get_if<Division>(&camera.distortion))
    sheet.k_per_mm2 = lens->K / (sheet.f_mm * sheet.f_mm);
  sheet.origin_from_centre_px = {camera.cx_px - camera.width_px / 2.0, camera.cy_px - camera.height_px / 2.0};
  return sheet;
}

}  // namespace zeropose
