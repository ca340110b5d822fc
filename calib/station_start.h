// Where to begin with a network of stations: put together pair by pair.
#pragma once

#include <string>
#include <vector>

#include "calib/station_network.h"

namespace zeropose {

struct StationStart {
  StationNetworkStatus status = StationNetworkStatus::failed;
  std::string reason;
  std::vector<Pose> X_AS;
};

// Stations whose common points give the pose between them become a group, groups likewise, most common points
// first, until all stand in the frame of the reference. Precondition: the problem is without fault.
StationStart join_stations(const StationNetworkProblem& problem);

// Names in a sentence, parted by commas; of many the first ones.
std::string list_of_names(const std::vector<std::string>& names);

}  // namespace zeropose
