#include "daemon/wheel_json.h"

#include "calib/rigid.h"

namespace zeropose {

nlohmann::json wheel_json(const WheelResult& wheel) {
  nlohmann::json json{{"finding", name_of(wheel.status)}, {"reason", wheel.reason}};
  if (wheel.status == WheelStatus::lines_not_ordered) json["lines"] = name_of(wheel.order);
  if (wheel.status != WheelStatus::ok) return json;
  json["camber_deg"] = wheel.camber_rad * degrees_per_radian;
  json["toe_deg"] = wheel.toe_rad * degrees_per_radian;
  json["sigma_camber_deg"] = wheel.sigma_camber_rad * degrees_per_radian;
  json["sigma_toe_deg"] = wheel.sigma_toe_rad * degrees_per_radian;
  json["profile_radius_mm"] = wheel.profile_radius_mm;
  return json;
}

}  // namespace zeropose
