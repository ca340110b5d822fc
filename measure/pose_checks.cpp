#include "measure/pose_checks.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>
#include <vector>

#include "calib/words.h"

namespace zeropose {
namespace {

bool is_number_not_below_zero(double value) { return std::isfinite(value) && value >= 0; }

// Are all of them finite? So is their sum then; huge numbers whose sum is not are of no use either.
template <typename... Numbers>
bool finite(Numbers... numbers) {
  return std::isfinite((numbers + ...));
}

bool valid(const CalibratedCamera& camera) {
  const CameraModel& model = camera.model;
  return model.fx_px > 0 && model.fy_px > 0 && camera.X_WC.matrix().allFinite() &&
         finite(model.fx_px, model.fy_px, model.cx_px, model.cy_px);
}

bool valid(const Mark& mark) {
  return finite(mark.p_O_mm.x(), mark.p_O_mm.y(), mark.p_O_mm.z(), mark.normal_O.x(), mark.normal_O.y(),
                mark.normal_O.z(), mark.radius_mm, mark.weight, mark.sigma_mm) &&
         mark.radius_mm >= 0 && mark.weight >= 0 && mark.weight <= 1 && mark.sigma_mm >= 0 &&
         mark.tolerance_px >= 0 && mark.tolerance_mm >= 0;
}

bool valid(const Eigen::Matrix2d& C) {
  return finite(C(0, 0), C(0, 1), C(1, 0), C(1, 1)) && C(0, 0) > 0 && C(1, 1) > 0 &&
         C(0, 0) * C(1, 1) - C(0, 1) * C(1, 0) > 0 &&
         std::abs(C(0, 1) - C(1, 0)) <= 1e-9 * (C(0, 0) + C(1, 1));
}

constexpr std::size_t none = std::numeric_limits<std::size_t>::max();

// What is wrong with an observation, or null. `checked` is the camera that was looked at last: most follow
// one of the same camera.
const char* fault_of(const PoseProblem& problem, const Observation& observation, std::size_t& checked) {
  if (observation.camera >= problem.cameras.size()) return "names a camera that does not exist";
  if (observation.mark >= problem.marks.size()) return "names a mark that does not exist";
  if (!finite(observation.u_px.x(), observation.u_px.y())) return "has a pixel that is not finite";
  if (!valid(observation.covariance_px2)) return "has a covariance that is not positive definite";
  if (!is_number_not_below_zero(observation.radius_share)) return "has a share of the radius that is none";
  if (observation.camera != checked && !valid(problem.cameras[observation.camera]))
    return "comes from a camera whose calibration is not usable";
  checked = observation.camera;
  if (!valid(problem.marks[observation.mark])) return "belongs to a mark whose numbers are not usable";
  return nullptr;
}

// Strictly ascending by camera and mark, or by mark and camera: then nothing comes twice.
bool in_order(std::span<const Observation> observations) {
  bool by_camera = true, by_mark = true;
  for (std::size_t i = 1; i < observations.size(); ++i) {
    const Observation &a = observations[i - 1], &b = observations[i];
    by_camera = by_camera && (a.camera < b.camera || (a.camera == b.camera && a.mark < b.mark));
    by_mark = by_mark && (a.mark < b.mark || (a.mark == b.mark && a.camera < b.camera));
  }
  return by_camera || by_mark;
}

// An observation of a mark that the same camera has seen before.
std::optional<std::size_t> repeated(std::span<const Observation> observations) {
  if (in_order(observations)) return std::nullopt;
  std::vector<std::size_t> order(observations.size());
  for (std::size_t i = 0; i < order.size(); ++i) order[i] = i;
  const auto place = [&](std::size_t i) { return std::pair(observations[i].camera, observations[i].mark); };
  std::stable_sort(order.begin(), order.end(), [&](auto a, auto b) { return place(a) < place(b); });
  const auto twin =
      std::adjacent_find(order.begin(), order.end(), [&](auto a, auto b) { return place(a) == place(b); });
  if (twin == order.end()) return std::nullopt;
  return *std::next(twin);
}

}  // namespace

std::string fault_of(const PoseProblem& problem) {
  if (!is_number_not_below_zero(problem.system_sigma_px)) return "the system's sigma is not a number >= 0";
  for (const auto* pose : {&problem.X_WO_start, &problem.X_WP_planar})
    if (*pose && !(*pose)->matrix().allFinite()) return "a given pose is not finite";
  std::size_t checked = none;
  for (std::size_t i = 0; i < problem.observations.size(); ++i)
    if (const char* fault = fault_of(problem, problem.observations[i], checked); fault != nullptr)
      return "observation " + number(i + 1) + " (from 1) " + fault;
  if (const auto twin = repeated(problem.observations))
    return "observation " + number(*twin + 1) +
           " (from 1) is of a mark that its camera has seen before: give each mark of a camera once";
  return {};
}

}  // namespace zeropose
