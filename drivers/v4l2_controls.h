// Settings of a V4L2 device by the name of its control.
#pragma once

#include "drivers/v4l2_handle.h"

namespace zeropose {

// Sets exposure, gain, black level and gamma where the options give them, then the controls by name in their
// order, and reads each back. Names count without case, spaces and punctuation: "OSD Text Mode" is
// osd_text_mode. Throws DeviceError: which control, what it takes, what to change in the cell file.
void set_v4l2_controls(const V4l2Handle& handle, const CameraOptions& options);

}  // namespace zeropose
