// What may be asked of the simulated cell while it runs, one JSON object per line. Poses as
// [x, y, z, rx, ry, rz] in mm and degrees (spec 92).
//
//   {"cmd":"shift","pose":[..]}    the object stands at X_O0O from its nominal pose; answered when every
//   frame
//                                  exposed from now on shows it there
//   {"cmd":"hand","robot":1,"pose":[..]}  the hand of this robot, with what it carries, is at X_RH (robot: 1)
//   {"cmd":"truth"}                -> X_WO, X_O0O, cameras that run, marks with faults
//   {"cmd":"fault","kind":KIND, ..}
//      camera-dead, camera-back    "camera": NAME
//      lose-packets                "camera": NAME, "ratio": 0..1 of its stream packets (0.01)
//      cover-mark                  "mark": NAME
//      wrong-mark                  "mark": NAME, "px": displacement in the image (20)
//      clear                       all faults end
//
// Answers {"status":"ok", ..} or {"status":"failed","reason":TEXT}.
#pragma once

#include <string>

#include "sim/simulated_cell.h"

namespace zeropose {

// Never throws for what is in the line.
std::string answer_cell_control(SimulatedCell& cell, const std::string& line);

// The fault KIND[:NAME], as on the command line. Throws std::invalid_argument.
void set_fault(SimulatedCell& cell, const std::string& fault);

// Six numbers, separated by commas or spaces, to a pose. Throws std::invalid_argument.
Pose pose_from_text(const std::string& text);

}  // namespace zeropose
