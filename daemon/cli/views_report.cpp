#include "daemon/cli/views_report.h"

#include <set>

#include "calib/words.h"
#include "config/calibration_page.h"
#include "config/text.h"

namespace zeropose {
namespace {

std::string step_text(const ViewsResult& result) {
  return concat({std::to_string(result.views.size()), " views, ", std::to_string(result.cameras.size()),
                 result.cameras.size() == 1 ? " camera, " : " cameras, ", std::to_string(result.iterations),
                 " steps"});
}

}  // namespace

std::string stage_text(const StageEstimate& stage) {
  if (!stage.unknown.empty()) return concat({"taken for the board's: ", stage.unknown});
  return concat(
      {stage.held ? "taken for the board's; the points say turned by "
                  : "estimated: turned against the board's by ",
       turn_text(stage),
       stage.held ? concat({" (so much or more by chance: ", number(100 * stage.chance, 1), " %)"}) : ""});
}

std::string page_of_camera(const CalibrationViews& input, const ViewsProblem& problem,
                           const ViewsResult& result, std::size_t camera, const std::string& source) {
  std::vector<CalibrationPoint> points;
  CalibrationResult own;
  std::set<std::size_t> views;
  for (std::size_t i = 0; i < input.points.size(); ++i) {
    if (input.points[i].camera != camera) continue;
    points.push_back(input.points[i].point);
    own.deviations.push_back(result.deviations[i]);
    views.insert(input.points[i].view);
  }
  const CameraEstimate& estimate = result.cameras[camera];
  own.status = CalibrationStatus::ok;
  own.model = estimate.model;
  own.X_WC = estimate.X_WC;
  own.uncertainty = estimate.internals;
  own.sigma_px = result.sigma_px;
  own.rms_px = estimate.rms_px;
  own.diagnosis = result.diagnosis;
  own.steps = {{"views together", step_text(result), result.rms_px}};
  if (result.stage) own.steps.push_back({"stage's axes", stage_text(*result.stage), result.stage->rms_px});
  CalibrationProblem part;
  part.points = points;
  part.width_px = problem.cameras[camera].width_px;
  part.height_px = problem.cameras[camera].height_px;
  part.lens = problem.cameras[camera].lens;
  part.sigma_px = problem.sigma_px;
  part.reject_px = problem.reject_px;
  return calibration_page(
      {part, own, input.cameras[camera], source, 0, 0, {}, 6 * static_cast<int>(views.size()), "X_WC"});
}

}  // namespace zeropose
