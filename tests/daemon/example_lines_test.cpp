// A line that ends in verdicts: the gun-check cell with a real camera on loopback, the daemon and the demo's
// robot, which checks every correction and every refusal against the truth.
#include "example_line.h"

namespace zeropose {
namespace {

using namespace std::chrono_literals;

TEST_F(ExampleLine, GunCheckGivesEveryVerdict) {
  // Of four guns the fourth is beyond a limit.
  const auto simulated = start_cell("gun-check", {"--drive", "--cars", "4"});
  const auto daemon = start_daemon(file_of("gun-check"));
  const Finished status = zeropose({"status", "--wait", "30"});
  ASSERT_EQ(status.out.find("MISSING"), std::string::npos) << status.out << logs();
  const Finished zero = zeropose({"zero"});
  ASSERT_EQ(zero.status, 0) << zero.out << zero.err;
  EXPECT_EQ(simulated->wait(60s), 0) << logs();
  EXPECT_NE(text_of_file(folder / "cell.log").find("4 | beyond its limit and refused: code 501"),
            std::string::npos)
      << logs();
}

}  // namespace
}  // namespace zeropose
