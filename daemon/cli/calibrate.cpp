#include "daemon/cli/calibrate.h"

#include "daemon/cli/calibrate_help.h"
#include "daemon/cli/calibrate_views.h"

namespace zeropose {

void add_calibrate(cli::Verb app, int& exit_status) {
  const cli::Verb verb = app.add_subcommand("calibrate", "Calibrates cameras; --help says which method when");
  verb.require_subcommand();
  verb.footer(cli::calibrate_help);
  add_calibrate_points(verb, exit_status);
  add_calibrate_views(verb, exit_status);
  add_calibrate_vanishing(verb, exit_status);
  add_calibrate_pose(verb, exit_status);
  add_calibrate_survey(verb, exit_status);
  add_calibrate_tool(verb, exit_status);
  add_calibrate_ball(verb, exit_status);
  add_calibrate_hand_eye(verb, exit_status);
  add_calibrate_body(verb, exit_status);
  add_calibrate_sensor(verb, exit_status);
}

}  // namespace zeropose
