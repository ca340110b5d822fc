// The daemon's control socket: questions of the command line as JSON lines, and their answers.
#pragma once

#include <filesystem>
#include <string>

namespace zeropose {

class Cycle;

// One JSON object in, one out: {"cmd": "status" | "measure" | "zero" | "snapshot" | "survey-start" | "survey"
// | "survey-end", ...}. Never throws: an error is an answer {"status": "error", "reason": ...}.
std::string answer_control(Cycle& cycle, const std::string& line);

// Where daemon and command line meet when nothing else is said: control.sock in $RUNTIME_DIRECTORY (systemd),
// else in /run/zeropose for root and in $XDG_RUNTIME_DIR/zeropose or /tmp/zeropose-UID for others.
std::filesystem::path default_control_socket();

}  // namespace zeropose
