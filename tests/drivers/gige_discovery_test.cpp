#include "drivers/gige_discovery.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/drivers/numbered_cameras.h"

namespace zeropose {
namespace {

using namespace std::chrono_literals;
using ::testing::HasSubstr;

TEST(DiscoverGige, FindsEveryCameraOnceWithWhatItSays) {
  NumberedCameras simulated(3, 64, 48);
  const auto cameras = discover_gige(600ms);
  ASSERT_EQ(cameras.size(), 3u);
  for (std::size_t i = 0; i < 3; ++i) {
    const std::string address = simulated.options(i).gige.address;
    EXPECT_EQ(cameras[i].address, address);
    EXPECT_EQ(cameras[i].vendor, "Aravis");
    EXPECT_EQ(cameras[i].model, "Fake");
    EXPECT_EQ(cameras[i].serial, "ZP-" + address);
    EXPECT_EQ(cameras[i].interface, "lo");
    EXPECT_EQ(cameras[i].mac.size(), 17u);
  }
}

TEST(DiscoverGige, NothingThere) {
  EXPECT_TRUE(discover_gige(100ms).empty());
  EXPECT_FALSE(find_gige(100ms, "lo", [](const auto&) { return true; }));
}

TEST(DiscoverGige, InterfaceThatIsMissing) {
  try {
    (void)discover_gige(100ms, "eth7");
    ADD_FAILURE() << "no DeviceError";
  } catch (const DeviceError& error) {
    EXPECT_THAT(error.what(), HasSubstr("network interface eth7 is missing"));
  }
}

TEST(DiscoverGige, FindReturnsWithTheCameraWanted) {
  NumberedCameras simulated(4, 64, 48);
  const auto begun = std::chrono::steady_clock::now();
  const auto camera =
      find_gige(60s, "lo", [](const FoundGigeCamera& found) { return found.serial == "ZP-127.0.0.13"; });
  EXPECT_LT(std::chrono::steady_clock::now() - begun, 30s);
  ASSERT_TRUE(camera);
  EXPECT_EQ(camera->address, "127.0.0.13");
}

}  // namespace
}  // namespace zeropose
