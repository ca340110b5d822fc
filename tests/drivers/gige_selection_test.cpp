// Which camera is used, over which interface and how.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "drivers/gige_camera.h"
#include "tests/drivers/gige_test.h"
#include "tests/drivers/numbered_cameras.h"

namespace zeropose {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

class Selection : public ::testing::Test {
 protected:
  std::string refusal() const {
    return failure([this] { const GigeCamera camera(options_); }).second;
  }
  // The camera from which a frame comes.
  std::uint64_t camera_of_a_frame() const {
    GigeCamera camera(options_);
    camera.start();
    const auto frame = triggered_frame(camera);
    return frame ? number_of(*frame).camera : 99;
  }

  NumberedCameras simulated_{3};
  CameraOptions options_ = simulated_.options(0);
};

TEST_F(Selection, BySerialNumber) {
  options_.gige = {.serial = "ZP-127.0.0.13"};
  EXPECT_EQ(camera_of_a_frame(), 2u);
}

TEST_F(Selection, ByNameOnOneInterface) {
  options_.gige = {.user_name = "user-camera2", .interface = "lo"};
  EXPECT_EQ(camera_of_a_frame(), 1u);
}

TEST_F(Selection, NobodyOfThatName) {
  options_.gige = {.serial = "4711"};
  EXPECT_THAT(refusal(), AllOf(HasSubstr("camera camera1 (serial 4711): no such camera answers"),
                               HasSubstr("zeropose cameras list")));
}

TEST_F(Selection, AddressWithItsOwnNames) {
  options_.gige.serial = "ZP-127.0.0.11";
  options_.gige.user_name = "user-camera1";
  EXPECT_EQ(camera_of_a_frame(), 0u);
}

TEST_F(Selection, SwappedAddressesAreFoundOut) {
  options_.gige.serial = "ZP-127.0.0.12";
  EXPECT_THAT(refusal(),
              AllOf(HasSubstr("serial number \"ZP-127.0.0.11\""), HasSubstr("wants \"ZP-127.0.0.12\""),
                    HasSubstr("two cameras swapped their addresses")));
  options_.gige.serial = "";
  options_.gige.user_name = "user-camera3";
  EXPECT_THAT(refusal(), AllOf(HasSubstr("user name \"user-camera1\""), HasSubstr("wants \"user-camera3\"")));
}

TEST_F(Selection, InterfaceThatIsMissing) {
  options_.gige.interface = "eth7";
  EXPECT_THAT(refusal(), HasSubstr("network interface eth7 is missing"));
}

TEST_F(Selection, PacketsAsLargeAsTold) {
  constexpr std::uint32_t packet_size_register = 0x0d04;
  options_.gige.packet_bytes = 1400;
  const GigeCamera camera(options_);
  EXPECT_EQ(simulated_.server().read_register(0, packet_size_register) & 0xffff, 1400u);
}

TEST_F(Selection, PacketsAboveTheMtuAreRefused) {
  options_.gige.packet_bytes = 65537;
  EXPECT_THAT(refusal(),
              AllOf(HasSubstr("network.packet_bytes 65537"), HasSubstr("interface lo takes (MTU 65536)")));
}

TEST_F(Selection, SocketsAndResends) {
  for (const PacketSocket socket : {PacketSocket::never, PacketSocket::automatic})
    for (const bool resend : {true, false}) {
      options_.gige.packet_socket = socket;
      options_.gige.resend = resend;
      EXPECT_EQ(camera_of_a_frame(), 0u);
    }
}

TEST_F(Selection, PacketSocketWorksOrIsRefused) {
  options_.gige.packet_socket = PacketSocket::always;
  try {
    EXPECT_EQ(camera_of_a_frame(), 0u);
  } catch (const DeviceError& error) {
    EXPECT_THAT(error.what(), HasSubstr("needs the right CAP_NET_RAW"));
  }
}

}  // namespace
}  // namespace zeropose
