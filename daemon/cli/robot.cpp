#include "daemon/cli/robot.h"

#include "daemon/cli/robot_check.h"
#include "daemon/cli/robot_monitor.h"

namespace zeropose {

void add_robot(cli::Verb app, int& exit_status) {
  const cli::Verb robot = app.add_subcommand("robot", "A robot's side of the interface: monitor, test");
  robot.require_subcommand();
  add_robot_monitor(robot, exit_status);
  add_robot_check(robot, exit_status);
}

}  // namespace zeropose
