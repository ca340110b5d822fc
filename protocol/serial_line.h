// A serial line as Modbus RTU uses it: its settings, how long a silence ends a frame, and its device.
#pragma once

#include <chrono>
#include <cstddef>
#include <string>

#include "protocol/line_socket.h"

namespace zeropose {

struct SerialLine {
  std::string device = "/dev/ttyUSB0";  // better a path of /dev/serial/by-id: it survives a replugging
  int baud = 19200;
  char parity = 'E';  // 'N', 'E' or 'O'
  int stop_bits = 1;  // 1 or 2
};

// Throws std::invalid_argument that names the value and what is allowed.
void check(const SerialLine& line);

// Of one character on the wire: start bit, eight data bits, parity, stop bits. Rounded up.
std::chrono::microseconds character_time(const SerialLine& line);
// Ends a frame: 3.5 characters; 1.75 ms above 19200 baud (MODBUS over Serial Line V1.02, 2.5.1.1).
std::chrono::microseconds frame_silence(const SerialLine& line);

// Raw, eight data bits, non-blocking, for this process alone; what was waiting there is thrown away. Throws
// std::runtime_error that names the device, the cause and what to do.
Descriptor open_line(const SerialLine& line);

}  // namespace zeropose
