#include "daemon/cli/robot.h"

#include "daemon/cli/robot_check.h"
#include "daemon/cli/robot_monitor.h"

namespace zeropose {

void add_robot(CLI::App& app, int& exit_status) {
  CLI::App* robot = app.add_subcommand("robot", "A robot's side of the interface: monitor, test");
  robot->require_subcommand(1);
  add_robot_monitor(*robot, exit_status);
  add_robot_check(*robot, exit_status);
}

}  // namespace zeropose
