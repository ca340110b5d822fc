// Proves before production that a robot understands its correction: convention, frame and sign (spec 80).
// Pure.
//
// The object is shifted by known poses, at least 10 degrees where it turns, and the robot is brought to the
// same place on it each time. Its controller shows where that is, in its maker's numbers. They must be found
// by the robot itself (three-point method, touching): the correction read back from it would agree whatever
// the convention is, because the same numbers are read back.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "protocol/conventions.h"

namespace zeropose {

struct KnownShift {
  std::string name;  // "turned 20 deg about y"
  Pose X_O0O = Pose::Identity();
};

// Shifts along x, y, z by 30, 40, 50 mm, turns about x, y, z by 15, 20, 25 deg, and one with all of them.
std::vector<KnownShift> known_shifts();

struct ConventionCheck {
  Convention convention = Convention::generic;  // that the cell file names for this robot
  std::vector<KnownShift> shifts;
  std::vector<double> at_zero;  // where the robot is while the object is at its zero, maker's numbers
  std::vector<std::vector<double>> went;  // where it is after each shift, in the order of shifts
  double tolerance_mm = 3;                // of one shift seen by the robot
  double tolerance_deg = 1.5;
};

struct ShiftVerdict {
  bool agrees = false;
  double off_mm = 0, off_deg = 0;  // what the robot saw, from what was done; 0 when the numbers are no pose
  std::string text;                // one line: agrees, or by how much not
};

struct ConventionVerdict {
  bool proven = false;                    // every shift agrees, and nothing else explains the numbers
  std::vector<ShiftVerdict> shifts;       // as in the question
  std::vector<std::string> explanations;  // on failure: each what would explain everything that was seen
  std::vector<Convention> same;  // conventions with the very same numbers, the checked one among them
  std::string text;              // the verdict in one or two sentences
};

// Throws std::invalid_argument when the numbers of poses differ, or there is no shift.
ConventionVerdict check_convention(const ConventionCheck& check);

// Whether both makers write every pose with the same numbers in the same order.
bool writes_the_same(Convention a, Convention b);

}  // namespace zeropose
