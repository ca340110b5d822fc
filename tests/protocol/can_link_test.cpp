// The link where there is no bus: it is alive, says what is missing, and its robot is as it was. What needs a
// bus is tested in the guest.
#include <gtest/gtest.h>

#include <thread>

#include "protocol/can_link.h"

namespace zeropose {
namespace {

void wait_until(const std::function<bool()>& condition) {
  for (int i = 0; i < 5000 && !condition(); ++i) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  EXPECT_TRUE(condition());
}

TEST(CanLink, WithoutAnInterfaceItLivesAndSaysWhatIsMissing) {
  RobotEndpoint endpoint({}, [](const Request&) {});
  CanOptions options;
  options.interface = "nosuchcan0";
  CanLink link(options, endpoint);
  wait_until([&] { return link.rounds() > 2; });
  EXPECT_EQ(link.problem().rfind("CAN nosuchcan0: ", 0), 0u) << link.problem();
  EXPECT_EQ(link.counters().opened, 0u);
  EXPECT_EQ(link.fault(), CanFault::none);
  // A change of the cycle wakes the loop; nothing is sent or accepted.
  const std::uint64_t rounds = link.rounds();
  endpoint.set_cell_state({true, true, true, false, 1, 2, 3, false});
  wait_until([&] { return link.rounds() > rounds; });
  EXPECT_EQ(endpoint.counters().accepted, 0u);
}

TEST(CanLink, RefusesBeforeItStarts) {
  RobotEndpoint endpoint({}, [](const Request&) {});
  CanOptions options;
  options.node = 128;
  EXPECT_THROW(CanLink(options, endpoint), std::invalid_argument);
  EndpointOptions abb;
  abb.handshake.convention = Convention::abb;
  RobotEndpoint quaternions(abb, [](const Request&) {});
  EXPECT_THROW(CanLink({}, quaternions), std::invalid_argument);
}

}  // namespace
}  // namespace zeropose
