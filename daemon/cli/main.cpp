// zeropose: the command line for the commissioning engineer, the operator and scripts.
#include <CLI/CLI.hpp>

#include "daemon/cli/batch.h"
#include "daemon/cli/cameras.h"
#include "daemon/cli/live.h"
#include "daemon/cli/robot.h"
#include "daemon/version.h"

int main(int argc, char** argv) {
  CLI::App app("zeropose: guides robots by cameras. Each verb has its own --help.");
  app.set_version_flag("--version", zeropose::version_text("zeropose"));
  app.require_subcommand(1);
  int exit_status = 0;
  zeropose::add_live_verbs(app, exit_status);
  zeropose::add_batch_verbs(app, exit_status);
  zeropose::add_cameras(app, exit_status);
  zeropose::add_robot(app, exit_status);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : 2;
  }
  return exit_status;
}
