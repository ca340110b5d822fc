#include <filesystem>
#include <memory>

#include "config/calibration_tables.h"
#include "config/text.h"
#include "daemon/cli/calibrate.h"
#include "daemon/cli/calibrate_help.h"
#include "daemon/cli/calibration_answer.h"
#include "daemon/cli/points_options.h"

namespace zeropose {
namespace {

using namespace cli;

Answer calibrate_points(const PointsOptions& options) {
  refuse_contradictions(options);
  const auto input = input_of(options, load_calibration_points(options.points));
  const CalibrationResult result = calibrate(input->problem);
  if (result.status != CalibrationStatus::ok) return calibration_failure(result);
  return answer_of(options, *input, result,
                   concat({"Points: ", std::filesystem::path(options.points).filename().string()}));
}

}  // namespace

void add_calibrate_points(cli::Verb calibrate, int& exit_status) {
  auto options = std::make_shared<PointsOptions>();
  const Verb verb = calibrate.add_subcommand("points", "One camera from known points and their pixels");
  verb.add_option("--points", options->points, "CSV: x_mm y_mm z_mm u_px v_px").required();
  add_problem_options(verb, *options);
  add_answer_options(verb, *options);
  verb.footer(calibrate_points_help);
  verb.callback([options, &exit_status] {
    exit_status = run([&] { return calibrate_points(*options); }, options->json);
  });
}

}  // namespace zeropose
