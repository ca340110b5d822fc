// What stands in a window, or what came nearest to it: the answer of the searches for all kinds of marks.
// Internal to the room.
#pragma once

#include <cstddef>
#include <vector>

#include "measure/marks.h"

namespace zeropose {

// Found, or it would be if it were not saturated.
bool stands(const MarkFinding& finding);

// How near to a found mark a failed one came, to choose whose reason is said.
int telling(const MarkFinding& finding);

struct MarkSight {
  std::vector<MarkFinding> standing;  // best contrast first
  MarkFinding nearest;                // what came nearest to one where none stands
  bool crowded = false;               // more things than were looked at: one of them may be the mark as well

  // In its place among those that stand, once for each thing; or as the nearest if it came nearer.
  void take(const MarkFinding& finding);
  bool found() const;
  // The one mark of the window, ambiguous where a second one stands beside it.
  MarkFinding only() const;
};

MarkSight sight_without(MarkStatus reason);

// Of a second one, by the contrast of the best one: then it is a rival.
inline constexpr double rival_contrast = 0.4;

// How many are wanted: one, then it looks until it is sure which one is the mark or that several are; or all,
// of the least contrast too, of which so many at most are looked at.
struct HowMany {
  std::size_t most = 0;  // 0: one

  bool one() const { return most == 0; }
};

}  // namespace zeropose
