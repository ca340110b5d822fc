// R1 of spec 85: a network between robot and daemon that doubles, delays, reorders and replays whatever is
// sent, over codec and handshake; and robots that come and go over TCP.
#include <gtest/gtest.h>

#include <deque>
#include <map>
#include <random>

#include "sim/robot.h"
#include "tests/protocol/amount.h"
#include "tests/protocol/link_fixture.h"

namespace zeropose {
namespace {

using std::chrono::milliseconds;

// Messages arrive when they like, some twice, some again when they are long forgotten.
template <class Registers>
class BadNetwork {
 public:
  BadNetwork(std::mt19937_64& random, bool clean) : random_(random), clean_(clean) {}

  void send(const Registers& message) {
    under_way_.push_back(message);
    if (clean_) return;
    if (random_() % 10 == 0) under_way_.push_back(message);
    if (random_() % 20 == 0) under_way_.pop_front();
    if (random_() % 10 == 0 && under_way_.size() > 1) std::swap(under_way_.front(), under_way_.back());
    old_.push_back(message);
    if (old_.size() > 300) old_.pop_front();
    if (random_() % 10 == 0) under_way_.push_back(old_[random_() % old_.size()]);
    while (under_way_.size() > 4) under_way_.pop_front();
  }
  // Mostly what was sent first.
  std::optional<Registers> receive() {
    if (under_way_.empty() || (!clean_ && random_() % 8 == 0)) return std::nullopt;
    const Registers message = under_way_.front();
    under_way_.pop_front();
    return message;
  }

 private:
  std::mt19937_64& random_;
  bool clean_;
  std::deque<Registers> under_way_, old_;
};

// A robot and the daemon's half of the link, with the time in their hands.
class Line {
 public:
  Line(std::uint64_t seed, bool clean)
      : random_(seed), clean_(clean), down_(random_, clean), up_(random_, clean) {
    HandshakeOptions options;
    options.convention = robot_.convention = Convention::kuka;
    options.frame = robot_.frame = 3;
    options.epoch = 77;
    options.validity = milliseconds(300);
    options.measure_deadline = milliseconds(60);
    robot_.patience = milliseconds(200);
    robot_.max_translation_mm = 1e6;
    handshake_.emplace(options);
    handshake_->set_cell_state(ready_cell(), now_);
  }

  void cycle() {
    ++cycles;
    const std::uint32_t id = ++last_id_ % 1000 == 0 ? ++last_id_ : last_id_;
    const auto part = static_cast<std::uint32_t>(random_() % 3);
    const Command measure{id, 1, 5, part, 0};
    const TimePoint started = now_;
    up_.send(encode_command(measure));
    bool done = false;
    for (int look = 0; look < 40 && !done; ++look) {
      daemon_side();
      down_.send(encode(handshake_->block(now_)));
      const TimePoint asked = now_;
      now_ += milliseconds(1 + random_() % 4);
      if (const auto block = down_.receive()) done = robot_looks(*block, id, part, started, asked);
    }
    if (done || random_() % 2 == 0) up_.send(encode_command({id, 2, 0, 0, 0}));
  }

  std::size_t cycles = 0, taken = 0, wrong = 0;

 private:
  void daemon_side() {
    for (int i = 0; i < 2; ++i)
      if (const auto registers = up_.receive())
        if (const auto command = decode_command(*registers)) take(*command);
    if (request_ && (clean_ || random_() % 3 == 0)) report();
  }
  void take(const Command& command) {
    const CommandOutcome outcome = handshake_->on_command(command, 1, now_);
    if (outcome.request && outcome.request->kind == CommandKind::measure) request_ = outcome.request;
  }
  // What was measured for a request: no two are alike, so that a foreign one is known by its value.
  void report() {
    Report report;
    report.request_id = request_->id;
    report.ticket = request_->ticket;
    report.code = !clean_ && random_() % 10 == 0 ? Code::too_few_marks : Code::ok;
    report.correction.translation() = Eigen::Vector3d(1e-3 * request_->id, request_->part, 0);
    request_.reset();
    handshake_->on_report(report, now_);
  }
  bool robot_looks(const ResultRegisters& block, std::uint32_t id, std::uint32_t part, TimePoint started,
                   TimePoint asked) {
    const auto since = [&](TimePoint then) { return std::chrono::ceil<milliseconds>(now_ - then); };
    const RobotExpectation expected{id, 77, part, 5, last_used_, since(asked), since(started)};
    const CheckedBlock checked = check_result(block, expected, robot_);
    if (!checked.correction) return checked.refusal == "not ok";
    last_used_ = id;
    ++taken;
    const Eigen::Vector3d truth(1e-3 * id, part, 0);
    if ((checked.correction->translation() - truth).norm() > 0.0006) ++wrong;
    return true;
  }

  std::mt19937_64 random_;
  bool clean_;
  BadNetwork<ResultRegisters> down_;
  BadNetwork<CommandRegisters> up_;
  SimulatedRobotOptions robot_;
  std::optional<Handshake> handshake_;
  TimePoint now_ = TimePoint() + std::chrono::hours(1);
  std::optional<Request> request_;
  std::uint32_t last_id_ = 0, last_used_ = 0;
};

TEST(Replay, AMillionCyclesOverABadNetwork) {
  Line line(60, false);
  while (line.cycles < amount(1000000)) line.cycle();
  EXPECT_EQ(line.wrong, 0u);
  EXPECT_GT(line.taken, line.cycles / 2);
}

TEST(Replay, EveryCycleOfACleanNetworkIsTaken) {
  Line line(61, true);
  while (line.cycles < 10000) line.cycle();
  EXPECT_EQ(line.wrong, 0u);
  EXPECT_EQ(line.taken, line.cycles);
}

// The cycle answers at once; the robot's connection breaks at any moment, while it asks, waits or reads.
TEST_F(LinkTest, TenThousandCyclesWithRandomDisconnects) {
  start_with_handler([this](const Request& request) {
    if (request.kind == CommandKind::measure) publish(ok_report(request));
  });
  recorder.watch("127.0.0.1", server->port());
  std::mt19937 random(62);
  std::optional<RawModbus> client;
  std::size_t valid = 0, broken = 0;
  const std::size_t cycles = amount(10000);
  for (std::uint32_t id = 1; id <= cycles; ++id) {
    if (!client) client.emplace(server->port());
    recorder.requested(id);
    const auto breaks = random() % 30;
    if (breaks == 0) client->send(adu(7, command_pdu({id, 1, 1, 77, 0})));
    if (breaks == 1) client->send(adu(7, read_pdu(4, 0, 61)));
    if (breaks <= 1) {
      client.reset();
      ++broken;
      continue;
    }
    ASSERT_EQ(client->command({id, 1, 1, 77, 0}), 0) << id;
    const ResultBlock block = client->block();
    ASSERT_EQ(block.request_id, id);
    ASSERT_TRUE(block.has(status_bit::result_valid));
    ++valid;
    if (breaks == 2) {
      client.reset();
      ++broken;
    } else {
      ASSERT_EQ(client->command({id, 2, 0, 0, 0}), 0);
      recorder.withdrawn(id);
    }
  }
  recorder.stop();
  EXPECT_GT(broken, cycles / 20);
  EXPECT_EQ(recorder.violations(), std::vector<std::string>());
  EXPECT_GT(valid, cycles / 2);
  RawModbus last(server->port());
  ASSERT_EQ(measure(last, static_cast<std::uint32_t>(cycles) + 1), 0);
  EXPECT_TRUE(last.block().has(status_bit::result_valid));
}

}  // namespace
}  // namespace zeropose
