// zeropose: the command line for the commissioning engineer, the operator and scripts.
#include "daemon/cli/batch.h"
#include "daemon/cli/cameras.h"
#include "daemon/cli/live.h"
#include "daemon/cli/robot.h"
#include "daemon/cli/verb.h"
#include "daemon/version.h"

int main(int argc, char** argv) {
  const auto add_verbs = [](zeropose::cli::Verb app, int& exit_status) {
    zeropose::add_live_verbs(app, exit_status);
    zeropose::add_batch_verbs(app, exit_status);
    zeropose::add_cameras(app, exit_status);
    zeropose::add_robot(app, exit_status);
  };
  return zeropose::cli::run_command_line("zeropose: guides robots by cameras. Each verb has its own --help.",
                                         zeropose::version_text("zeropose"), add_verbs, argc, argv);
}
