// The robots of a cell file: how each is reached. Internal to the room.
#pragma once

#include "config/json_reader.h"
#include "protocol/link_options.h"

namespace zeropose {

// Reads "link" and what a robot's own object says of it (lists of addresses, CRC, data ids). What could not
// be read of an address or a port is empty or 0.
LinkOptions read_link_options(JsonObject& robot);

}  // namespace zeropose
