// The recorder must find what is wrong, or its silence in the other tests means nothing. Then a storm.
#include "tests/support/recorder.h"

#include <gmock/gmock.h>

#include <random>

#include "sim/robot.h"
#include "tests/protocol/link_fixture.h"

namespace zeropose {
namespace {

using std::chrono::milliseconds;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

Report report_of(std::uint32_t id) {
  Report report;
  report.request_id = id;
  report.code = Code::ok;
  report.correction = from_six_numbers({1, 2, 3, 0, 0, 0});
  return report;
}

ResultBlock valid_block(std::uint32_t id) {
  ResultBlock block;
  put_report(report_of(id), Convention::kuka, block);
  block.epoch = 5;
  block.sequence = 6;
  block.request_id = id;
  block.robot_index = 3;
  block.state = LinkState::ready;
  block.status |= status_bit::ready | status_bit::exposure_done;
  block.age_ms = 1;
  block.validity_ms = 100;
  return block;
}

class RecorderTest : public testing::Test {
 protected:
  RecorderTest() : recorder({Convention::kuka, 3, default_result_data_id}) {
    recorder.requested(7);
    recorder.reported(report_of(7));
  }
  void see(const ResultBlock& block) { recorder.see(encode(block), Recorder::Clock::now()); }
  Recorder recorder;
};

TEST_F(RecorderTest, WhatIsRightIsNoViolation) {
  see(valid_block(7));
  see(valid_block(7));
  EXPECT_THAT(recorder.violations(), IsEmpty());
  EXPECT_EQ(recorder.valid_blocks(), 2u);
  EXPECT_TRUE(recorder.saw_valid(7));
}

TEST_F(RecorderTest, FindsWhatIsWrong) {
  struct Case {
    const char* violation;
    void (*change)(ResultBlock&);
  };
  const Case cases[] = {
      {"never made", [](ResultBlock& b) { b.request_id = 8; }},
      {"not what the cycle reported", [](ResultBlock& b) { b.values[0] += 1; }},
      {"values are no correction", [](ResultBlock& b) { b.values[2] = invalid_value; }},
      {"valid and something else", [](ResultBlock& b) { b.status |= status_bit::busy; }},
      {"valid with a code", [](ResultBlock& b) { b.code = 501; }},
      {"beyond its validity", [](ResultBlock& b) { b.age_ms = 101; }},
      {"without exposure",
       [](ResultBlock& b) { b.status &= static_cast<std::uint16_t>(~status_bit::exposure_done); }},
      {"another robot", [](ResultBlock& b) { b.robot_index = 1; }}};
  for (const Case& entry : cases) {
    Recorder fresh({Convention::kuka, 3, default_result_data_id});
    fresh.requested(7);
    fresh.reported(report_of(7));
    ResultBlock block = valid_block(7);
    entry.change(block);
    fresh.see(encode(block), Recorder::Clock::now());
    EXPECT_THAT(fresh.violations(), ElementsAre(HasSubstr(entry.violation)));
  }
}

TEST_F(RecorderTest, FindsAResultAfterItWasWithdrawn) {
  see(valid_block(7));
  const auto before = Recorder::Clock::now();
  recorder.withdrawn(7);
  recorder.see(encode(valid_block(7)), before);  // was on its way
  EXPECT_THAT(recorder.violations(), IsEmpty());
  see(valid_block(7));
  EXPECT_THAT(recorder.violations(), ElementsAre(HasSubstr("after it was withdrawn")));
}

TEST_F(RecorderTest, FindsTwoContentsOfOneSequence) {
  ResultBlock block = valid_block(7);
  see(block);
  block.effective_marks = 9;
  see(block);
  EXPECT_THAT(recorder.violations(), ElementsAre(HasSubstr("same sequence number")));
}

TEST_F(RecorderTest, FindsADamagedBlock) {
  ResultRegisters registers = encode(valid_block(7));
  registers[20] ^= 1;
  recorder.see(registers, Recorder::Clock::now());
  EXPECT_THAT(recorder.violations(), ElementsAre(HasSubstr("wrong CRC")));
}

TEST_F(RecorderTest, ComparesWithTheTruth) {
  recorder.requested(7);
  recorder.truth(7, from_six_numbers({1, 2, 3.05, 0, 0, 0}), 0.1, 0.01);
  see(valid_block(7));
  EXPECT_THAT(recorder.violations(), IsEmpty());
  recorder.truth(7, from_six_numbers({1, 2, 3.2, 0, 0, 0}), 0.1, 0.01);
  see(valid_block(7));
  EXPECT_THAT(recorder.violations(), ElementsAre(HasSubstr("a wrong correction")));
}

TEST(RecorderJudgement, AsksTheTest) {
  Recorder recorder(
      {Convention::kuka, 3, default_result_data_id},
      [](const ResultBlock&, const Pose& correction) { return correction.translation().norm() < 1; });
  recorder.requested(7);
  recorder.see(encode(valid_block(7)), Recorder::Clock::now());
  EXPECT_THAT(recorder.violations(), ElementsAre(HasSubstr("implausible")));
}

// A cycle in a thread of its own that answers rightly, late, twice, for foreign ids, or never.
class WildCycle {
 public:
  WildCycle(Recorder& recorder, std::uint64_t seed)
      : recorder_(recorder), random_(seed), thread_([this] { run(); }) {}
  ~WildCycle() {
    {
      const std::scoped_lock lock(mutex_);
      stopping_ = true;
    }
    came_.notify_all();
    thread_.join();
  }
  void attach(RobotEndpoint* endpoint) {
    const std::scoped_lock lock(mutex_);
    endpoint_ = endpoint;
  }
  void take(const Request& request) {
    const std::scoped_lock lock(mutex_);
    requests_.push_back(request);
    came_.notify_all();
  }

 private:
  void run() {
    std::unique_lock lock(mutex_);
    while (true) {
      came_.wait(lock, [this] { return stopping_ || !requests_.empty(); });
      if (stopping_) return;
      const Request request = requests_.front();
      requests_.pop_front();
      lock.unlock();
      answer(request);
      lock.lock();
    }
  }
  void answer(const Request& request) {
    const auto fate = random_() % 20;
    if (fate == 0) return;
    if (fate == 1) std::this_thread::sleep_for(milliseconds(40));
    endpoint_->exposure_done(request.id);
    Report report = report_of(request.id);
    report.ticket = request.ticket;
    report.correction.translation().x() = 0.001 * (request.id % 1000);
    if (fate == 2) report.code = Code::deviation_not_attributable;
    if (fate == 3) report.correction.translation().z() = 1e9;
    if (fate == 4) publish_foreign(request);
    if (fate == 5) endpoint_->set_cell_state(ready_cell());
    recorder_.reported(report);
    endpoint_->publish(report);
    if (fate == 6) endpoint_->publish(report);
  }

  // The id may even be that of the request that follows, when this one is late: the ticket is not.
  void publish_foreign(const Request& request) {
    Report foreign = report_of(request.id + 1);
    foreign.ticket = request.ticket;
    endpoint_->publish(foreign);
  }

  Recorder& recorder_;
  std::mt19937_64 random_;
  std::mutex mutex_;
  std::condition_variable came_;
  std::deque<Request> requests_;
  RobotEndpoint* endpoint_ = nullptr;
  bool stopping_ = false;
  std::thread thread_;
};

// Robots come and go, others disturb, the cycle is wild: never a wrong valid result, and enough right ones.
TEST_F(LinkTest, Storm) {
  handshake.measure_deadline = milliseconds(20);
  handshake.validity = milliseconds(300);
  WildCycle cycle(recorder, 30);
  start_with_handler([&](const Request& request) { cycle.take(request); });
  cycle.attach(&*endpoint);
  recorder.watch("127.0.0.1", server->port());
  recorder.watch("127.0.0.1", server->port());

  SimulatedRobotOptions robot_options;
  robot_options.port = server->port();
  robot_options.convention = Convention::kuka;
  robot_options.frame = 3;
  robot_options.robot_index = 3;
  SimulatedRobot robot(robot_options);
  std::atomic<bool> stop{false};
  std::thread disturber([&] {
    std::mt19937 random(31);
    while (!stop) {
      RawModbus client(server->port());
      for (int i = 0; i < 20 && !stop; ++i) {
        Bytes bytes = adu(1, random() % 2 ? command_pdu({0, 1, 1, 0, 0}) : read_pdu(4, 0, 61));
        if (random() % 4 == 0) bytes[random() % bytes.size()] ^= 0x40;
        client.send(bytes);
        if (client.receive().empty()) break;
      }
    }
  });
  int taken = 0;
  for (std::uint32_t id = 1; id <= 400; ++id) {
    recorder.requested(id);
    const RobotAnswer answer = robot.measure(1, id);
    ASSERT_EQ(answer.request_id, id) << answer.refusal;
    if (answer.correction) {
      ++taken;
      EXPECT_NEAR(answer.correction->translation().x(), 0.001 * (id % 1000), 0.00051);
    }
    if (id % 7 == 0) robot.disconnect();
    if (id % 7 != 0 && robot.acknowledge().ok()) recorder.withdrawn(id);
  }
  stop = true;
  disturber.join();
  recorder.stop();
  EXPECT_GT(taken, 200);
  EXPECT_GT(recorder.valid_blocks(), 400u);
  EXPECT_GT(recorder.blocks(), 2000u);
}

// One snapshot for each answer, however fast the block changes.
TEST_F(LinkTest, ManyReadersNeverSeeATornBlock) {
  start_with_handler([&](const Request& request) { publish(ok_report(request)); });
  for (int i = 0; i < 4; ++i) recorder.watch("127.0.0.1", server->port());
  RawModbus client(server->port());
  for (std::uint32_t id = 1; id <= 1000; ++id) ASSERT_EQ(measure(client, id), 0);
  wait_until([&] { return recorder.blocks() > 5000; });
  recorder.stop();
  EXPECT_GT(recorder.valid_blocks(), 1000u);
}

}  // namespace
}  // namespace zeropose
