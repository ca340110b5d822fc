#include "drivers/gige_packets.h"

#include <arv.h>

#include <algorithm>

namespace zeropose {
namespace {

constexpr int untested_packet_bytes = 1500;

}  // namespace

void GigePackets::fail(const std::string& what) const { throw DeviceError(title_of(options_) + ": " + what); }

void GigePackets::require(const GigeError& error, std::string_view doing) const {
  if (error) fail(std::string(doing) + " failed: " + error.text() + "; check its power, cable and address");
}

void GigePackets::configure(const NetworkInterface& interface) const {
  choose_socket();
  set_packet_size(interface);
}

// Between hosts only a test shows what the switches let through.
int GigePackets::tested_packet_bytes(const NetworkInterface& interface) const {
  const int largest = largest_packet_bytes(interface);
  if (interface.loopback) return largest;
  const int safe = std::min(largest, untested_packet_bytes);
  GigeError error;
  arv_gv_device_set_packet_size(ARV_GV_DEVICE(device_), safe, error.out());
  require(error, "setting the packet size");
  const auto tested = static_cast<int>(arv_gv_device_auto_packet_size(ARV_GV_DEVICE(device_), error.out()));
  return error ? safe : std::min(tested, largest);
}

int GigePackets::wanted_packet_bytes(const NetworkInterface& interface) const {
  const int wanted = options_.gige.packet_bytes;
  if (wanted == 0) return tested_packet_bytes(interface);
  if (wanted > interface.mtu_bytes)
    fail("network.packet_bytes " + std::to_string(wanted) + " is above what interface " + interface.name +
         " takes (MTU " + std::to_string(interface.mtu_bytes) +
         "); lower it in the cell file or raise the MTU");
  return wanted;
}

// Left to itself the library prefers a packet socket where it is allowed. That hands over its packets up to
// 5 ms late, and wrong pixels as a whole frame when a packet is above the MTU. So it is only for where a
// plain UDP socket would lose packets for want of a buffer.
void GigePackets::choose_socket() const {
  bool plain = options_.gige.packet_socket == PacketSocket::never;
  if (options_.gige.packet_socket == PacketSocket::automatic)
    plain = receive_buffer_allowed(socket_buffer_bytes);
  else if (!plain && !packet_socket_allowed())
    fail(
        "network.packet_socket \"always\" needs the right CAP_NET_RAW; give it to the program or choose "
        "\"automatic\" in the cell file");
  arv_gv_device_set_stream_options(ARV_GV_DEVICE(device_), plain ? ARV_GV_STREAM_OPTION_PACKET_SOCKET_DISABLED
                                                                 : ARV_GV_STREAM_OPTION_NONE);
}

void GigePackets::set_packet_size(const NetworkInterface& interface) const {
  ArvGvDevice* gv_device = ARV_GV_DEVICE(device_);
  arv_gv_device_set_packet_size_adjustment(gv_device, ARV_GV_PACKET_SIZE_ADJUSTMENT_NEVER);
  GigeError error;
  arv_gv_device_set_packet_size(gv_device, wanted_packet_bytes(interface), error.out());
  require(error, "setting the packet size");
  const auto got = static_cast<int>(arv_gv_device_get_packet_size(gv_device, error.out()));
  require(error, "reading the packet size back");
  if (got > interface.mtu_bytes)
    fail("insists on packets of " + std::to_string(got) + " bytes, interface " + interface.name + " takes " +
         std::to_string(interface.mtu_bytes) + "; raise its MTU");
}

}  // namespace zeropose
