// The cameras of a cell file: how each is opened. Internal to the room.
#pragma once

#include "config/json_reader.h"
#include "drivers/camera_options.h"

namespace zeropose {

// Reads one member of "cameras"; mistakes go to the object's reading. A folder stays relative to the file.
CameraOptions read_camera_options(JsonObject& object);

// An IPv4 address, unchanged when the text is none. The key must be there.
void read_address(JsonObject& object, std::string_view key, std::string& address);

}  // namespace zeropose
