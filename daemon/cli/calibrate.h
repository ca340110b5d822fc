// zeropose calibrate: cameras from known points, views, boards and vanishing points (spec 30, 92).
#pragma once

#include <CLI/CLI.hpp>

namespace zeropose {

// Adds the verb with its subcommands; exit_status as in batch.h.
void add_calibrate(CLI::App& app, int& exit_status);

// Its subcommands, each in a file of its own.
void add_calibrate_ball(CLI::App& calibrate, int& exit_status);
void add_calibrate_body(CLI::App& calibrate, int& exit_status);
void add_calibrate_hand_eye(CLI::App& calibrate, int& exit_status);
void add_calibrate_points(CLI::App& calibrate, int& exit_status);
void add_calibrate_pose(CLI::App& calibrate, int& exit_status);
void add_calibrate_sensor(CLI::App& calibrate, int& exit_status);
void add_calibrate_survey(CLI::App& calibrate, int& exit_status);
void add_calibrate_tool(CLI::App& calibrate, int& exit_status);
void add_calibrate_vanishing(CLI::App& calibrate, int& exit_status);

}  // namespace zeropose
