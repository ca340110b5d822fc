#include "protocol/serial_line.h"

#include <fcntl.h>
#include <sys/ioctl.h>
#include <termios.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <stdexcept>

namespace zeropose {
namespace {

using std::chrono::microseconds;

struct Speed {
  int baud;
  speed_t constant;
};
constexpr std::array speeds = {Speed{1200, B1200},     Speed{2400, B2400},     Speed{4800, B4800},
                               Speed{9600, B9600},     Speed{19200, B19200},   Speed{38400, B38400},
                               Speed{57600, B57600},   Speed{115200, B115200}, Speed{230400, B230400},
                               Speed{460800, B460800}, Speed{921600, B921600}};

const Speed* speed_of(int baud) {
  const auto* it = std::ranges::find(speeds, baud, &Speed::baud);
  return it == speeds.end() ? nullptr : it;
}

std::string remedy(int error) {
  switch (error) {
    case ENOENT:
    case ENODEV:
    case ENXIO:
      return "is the adapter plugged in? See /dev/serial/by-id";
    case EACCES:
      return "add the service's user to the group of the device (dialout)";
    case EBUSY:
      return "another program uses the line: stop it";
    case ENOTTY:
      return "this is no serial device";
    default:
      return "see the cause";
  }
}

[[noreturn]] void fail(const SerialLine& line, const char* call) {
  const int error = errno;
  throw std::runtime_error("Modbus RTU: cannot use " + line.device + " (" + call + ": " +
                           std::strerror(error) + "); " + remedy(error));
}

termios settings_of(const SerialLine& line) {
  termios settings{};
  settings.c_cflag = CS8 | CREAD | CLOCAL;
  if (line.parity != 'N') settings.c_cflag |= PARENB;
  if (line.parity == 'O') settings.c_cflag |= PARODD;
  if (line.stop_bits == 2) settings.c_cflag |= CSTOPB;
  // A character with wrong parity arrives as 0: the CRC of its frame is then wrong, the frame is not
  // shortened.
  settings.c_iflag = line.parity == 'N' ? IGNBRK : IGNBRK | INPCK;
  const speed_t speed = speed_of(line.baud)->constant;
  cfsetispeed(&settings, speed);
  cfsetospeed(&settings, speed);
  return settings;
}

}  // namespace

void check(const SerialLine& line) {
  const auto refuse = [](const std::string& what) { throw std::invalid_argument("Modbus RTU: " + what); };
  if (line.device.empty()) refuse("no device is given, for instance /dev/serial/by-id/...");
  if (speed_of(line.baud) == nullptr)
    refuse("baud " + std::to_string(line.baud) +
           " is not offered; 1200, 2400, 4800, 9600, 19200, 38400, 57600, 115200, 230400, 460800 and 921600 "
           "are");
  if (line.parity != 'N' && line.parity != 'E' && line.parity != 'O')
    refuse(std::string("parity must be N, E or O, not \"") + line.parity + '"');
  if (line.stop_bits != 1 && line.stop_bits != 2)
    refuse("stop bits must be 1 or 2, not " + std::to_string(line.stop_bits));
}

microseconds character_time(const SerialLine& line) {
  const int bits = 1 + 8 + (line.parity == 'N' ? 0 : 1) + line.stop_bits;
  return microseconds((bits * 1'000'000 + line.baud - 1) / line.baud);
}

microseconds frame_silence(const SerialLine& line) {
  if (line.baud > 19200) return microseconds(1750);
  return character_time(line) * 7 / 2;
}

Descriptor open_line(const SerialLine& line) {
  Descriptor device(open(line.device.c_str(), O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC));
  if (!device) fail(line, "open");
  if (ioctl(device.get(), TIOCEXCL) != 0) fail(line, "TIOCEXCL");
  const termios settings = settings_of(line);
  if (tcsetattr(device.get(), TCSANOW, &settings) != 0) fail(line, "tcsetattr");
  if (tcflush(device.get(), TCIOFLUSH) != 0) fail(line, "tcflush");
  return device;
}

}  // namespace zeropose
