// A line that ends in verdicts: the gun-check cell with a real camera on loopback, the daemon and the demo's
// robot, which checks every correction and every refusal against the truth.
#include <gtest/gtest.h>
#include <unistd.h>

#include <fstream>
#include <sstream>

#include "tests/support/process.h"

namespace zeropose {
namespace {

using namespace std::chrono_literals;

std::string program(const char* name) { return std::string(ZEROPOSE_BIN_DIR) + "/" + name; }

std::string text_of(const std::filesystem::path& file) {
  std::stringstream text;
  text << std::ifstream(file).rdbuf();
  return text.str();
}

class ExampleLine : public testing::Test {
 protected:
  void SetUp() override {
    std::string name = (std::filesystem::temp_directory_path() / "zeropose-line-XXXXXX").string();
    ASSERT_NE(::mkdtemp(name.data()), nullptr);
    folder = name;
  }
  void TearDown() override { std::filesystem::remove_all(folder); }

  Finished zeropose(std::vector<std::string> arguments) const {
    arguments.insert(arguments.begin(), program("zeropose"));
    arguments.insert(arguments.end(), {"--socket", (folder / "zeropose.sock").string()});
    return run_program(arguments);
  }

  std::filesystem::path folder;
};

TEST_F(ExampleLine, GunCheckGivesEveryVerdict) {
  const std::string cell = ZEROPOSE_SOURCE_DIR "/config/cells/gun-check.json";
  // Of four guns the fourth is beyond a limit.
  Process simulated({program("zeropose-cell"), "--cell", cell, "--drive", "--cars", "4"},
                    folder / "cell.log");
  Process daemon({program("zeroposed"), "--cell", cell, "--state", (folder / "state").string(), "--socket",
                  (folder / "zeropose.sock").string()},
                 folder / "daemon.log");
  for (int attempt = 0; attempt < 100 && !std::filesystem::exists(folder / "zeropose.sock"); ++attempt)
    std::this_thread::sleep_for(100ms);
  const Finished status = zeropose({"status", "--wait", "30"});
  ASSERT_EQ(status.out.find("MISSING"), std::string::npos) << status.out << text_of(folder / "daemon.log");
  const Finished zero = zeropose({"zero"});
  ASSERT_EQ(zero.status, 0) << zero.out << zero.err;
  EXPECT_EQ(simulated.wait(60s), 0) << text_of(folder / "cell.log") << text_of(folder / "daemon.log");
  EXPECT_NE(text_of(folder / "cell.log").find("4 | beyond its limit and refused: code 501"),
            std::string::npos)
      << text_of(folder / "cell.log");
}

}  // namespace
}  // namespace zeropose
