// zeropose calibrate: cameras from known points, views, boards and vanishing points (spec 30, 92).
#pragma once

#include "daemon/cli/verb.h"

namespace zeropose {

// Adds the verb with its subcommands; exit_status as in batch.h.
void add_calibrate(cli::Verb app, int& exit_status);

// Its subcommands, each in a file of its own.
void add_calibrate_ball(cli::Verb calibrate, int& exit_status);
void add_calibrate_body(cli::Verb calibrate, int& exit_status);
void add_calibrate_hand_eye(cli::Verb calibrate, int& exit_status);
void add_calibrate_points(cli::Verb calibrate, int& exit_status);
void add_calibrate_pose(cli::Verb calibrate, int& exit_status);
void add_calibrate_sensor(cli::Verb calibrate, int& exit_status);
void add_calibrate_survey(cli::Verb calibrate, int& exit_status);
void add_calibrate_tool(cli::Verb calibrate, int& exit_status);
void add_calibrate_vanishing(cli::Verb calibrate, int& exit_status);

}  // namespace zeropose
