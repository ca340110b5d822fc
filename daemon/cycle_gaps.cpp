// What the cycle does for a job that evens gaps.
#include "daemon/cycle.h"

namespace zeropose {

std::string Cycle::not_for(const Job& job, std::size_t robot) const {
  if (!job.gaps) return {};
  const std::size_t carries = cell_.hand_of.at(job.gaps->gaps.front().camera).value();
  if (carries == robot) return {};
  return "job " + job.name + " is for " + cell_.robots.at(carries).name +
         ", which carries its cameras and the pane";
}

void Cycle::find_gaps(std::size_t camera, Snapshot& snapshot) const {
  const Job& job = cell_.jobs[selected_];
  if (!job.gaps) return;
  for (const GapView& gap : job.gaps->gaps)
    if (gap.camera == camera)
      snapshot.gaps.push_back(
          {gap.name, gap.search,
           measure_gap({cell_.calibration[camera], gap.plane, gap.search, view_of(snapshot.grabbed.frame)})});
}

}  // namespace zeropose
