// R6, R7 and R9 of spec 85: many readers, slow clients, a flood. What they cost a robot in time is measured
// by bench_link; here it is proved that nobody gets a wrong block and that the robot goes on.
#include <gtest/gtest.h>
#include <unistd.h>

#include <fstream>

#include "tests/protocol/amount.h"
#include "tests/protocol/link_fixture.h"

namespace zeropose {
namespace {

using std::chrono::milliseconds;
using Clock = std::chrono::steady_clock;

double resident_mb() {
  std::ifstream file("/proc/self/statm");
  double all = 0, resident = 0;
  file >> all >> resident;
  return resident * static_cast<double>(sysconf(_SC_PAGESIZE)) / 1e6;
}

// A new answer every millisecond, eight readers that never rest.
class Readers : public LinkTest {
 protected:
  void read(std::size_t reads) {
    start_with_handler([&](const Request& request) { publish(ok_report(request)); });
    for (int i = 0; i < 8; ++i) recorder.watch("127.0.0.1", server->port());
    const ConnectionId robot = RobotEndpoint::new_connection();
    auto next = Clock::now();
    std::uint32_t id = 0;
    while (server->counters().reads < reads) {
      recorder.requested(++id);
      ASSERT_EQ(endpoint->command({id, 1, 1, 77, 0}, robot), CommandVerdict::accepted);
      next = std::max(next + milliseconds(1), Clock::now() - milliseconds(50));
      std::this_thread::sleep_until(next);
    }
    recorder.stop();
    EXPECT_GT(recorder.valid_blocks(), reads / 2);
  }
};
using ReadersLong = Readers;

TEST_F(Readers, AMillionReadsAndNoneTorn) { read(amount(1000000)); }
TEST_F(ReadersLong, TenMillionReadsAndNoneTorn) { read(amount(10000000)); }

// Each sends a request byte by byte; everyone is closed a second after its first byte, and the robot does not
// notice.
TEST_F(LinkTest, AHundredSlowClients) {
  start();
  RawModbus robot(server->port());
  std::vector<RawModbus> slow;
  for (int i = 0; i < 100; ++i) slow.emplace_back(server->port());
  const Bytes whole = adu(1, command_pdu({5, 1, 1, 0, 0}));
  const auto started = Clock::now();
  std::uint32_t id = 0;
  std::size_t sent = 0;
  while (server->counters().closed_slow < slow.size()) {
    if (Clock::now() >= started + sent * milliseconds(400)) {
      for (RawModbus& client : slow) client.send({whole[sent]});
      ++sent;
    }
    expect_clean_cycle(robot, ++id);
    ASSERT_LT(Clock::now() - started, milliseconds(5000));
  }
  // A second for the frame, and what the machine needs to come round.
  EXPECT_LT(Clock::now() - started, options.frame_time + milliseconds(500));
  EXPECT_GT(id, 100u);
  EXPECT_TRUE(requests.empty());
  for (RawModbus& client : slow) EXPECT_TRUE(client.closed_by_peer(milliseconds(500)));
}

// Requests of all kinds as fast as they are taken, and connections that come and go.
TEST_F(LinkTest, AFlood) {
  start();
  RawModbus robot(server->port());
  for (std::uint32_t id = 1; id <= 100; ++id) expect_clean_cycle(robot, id);
  const double before_mb = resident_mb();
  std::atomic<bool> stop{false};
  std::atomic<std::size_t> asked{0}, connected{0};
  std::vector<std::thread> flood;
  for (int i = 0; i < 4; ++i)
    flood.emplace_back([&] {
      RawModbus client(server->port());
      while (!stop) {
        const int refusal = client.read_registers() ? client.command({0, 1, 1, 0, 0}) : -1;
        // Request id 0, or busy with the robot's.
        if (refusal != 3 && refusal != 6) {
          ADD_FAILURE() << "a client of the flood was answered " << refusal;
          return;
        }
        asked += 2;
      }
    });
  flood.emplace_back([&] {
    while (!stop) {
      RawModbus client(server->port());
      if (++connected % 2 == 0) client.send(adu(1, read_pdu(4, 0, 61)));
    }
  });
  std::uint32_t id = 1000;
  const std::size_t enough = amount(20000);
  while (!HasFailure() && (asked < enough || connected < enough / 10)) {
    expect_clean_cycle(robot, ++id);
    std::this_thread::sleep_for(milliseconds(5));  // the recorder remembers every cycle, which costs memory
  }
  stop = true;
  for (std::thread& thread : flood) thread.join();
  EXPECT_LT(resident_mb() - before_mb, 10.0);
  expect_clean_cycle(robot, ++id);
  wait_until([&] { return server->counters().clients == 1; });
}

}  // namespace
}  // namespace zeropose
