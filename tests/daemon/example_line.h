// A line of an example cell as the demo runs it: its cameras on loopback, the daemon, the command line.
#pragma once

#include <gtest/gtest.h>

#include <filesystem>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "tests/support/process.h"
#include "tests/support/temporary_folder.h"

namespace zeropose {

inline std::string bin(const char* name) { return program_folder() / name; }

class ExampleLine : public testing::Test {
 protected:
  Finished zeropose(std::vector<std::string> arguments) const {
    arguments.insert(arguments.begin(), bin("zeropose"));
    arguments.insert(arguments.end(), {"--socket", (folder / "zeropose.sock").string()});
    return run_program(arguments);
  }
  // The simulated cell with more options, and the daemon.
  std::unique_ptr<Process> start_cell(const std::string& cell, std::vector<std::string> options) const {
    std::vector<std::string> arguments{bin("zeropose-cell"), "--cell", file_of(cell)};
    arguments.insert(arguments.end(), options.begin(), options.end());
    return std::make_unique<Process>(arguments, folder / "cell.log");
  }
  // And waits for its socket.
  std::unique_ptr<Process> start_daemon(const std::filesystem::path& cell) const {
    auto daemon =
        std::make_unique<Process>(std::vector<std::string>{bin("zeroposed"), "--cell", cell.string(),
                                                           "--state", (folder / "state").string(), "--socket",
                                                           (folder / "zeropose.sock").string()},
                                  folder / "daemon.log");
    for (int attempt = 0; attempt < 100 && !std::filesystem::exists(folder / "zeropose.sock"); ++attempt)
      std::this_thread::sleep_for(std::chrono::milliseconds(100));
    return daemon;
  }
  static std::string file_of(const std::string& cell) {
    return ZEROPOSE_SOURCE_DIR "/config/cells/" + cell + ".json";
  }
  std::string logs() const { return text_of_file(folder / "cell.log") + text_of_file(folder / "daemon.log"); }

  const TemporaryFolder folder;
};

}  // namespace zeropose
