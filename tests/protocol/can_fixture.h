// A CAN node with a handshake behind it and a bus in the test's hand: it echoes each frame at once, or not.
#pragma once

#include <gtest/gtest.h>

#include <random>

#include "protocol/can_collector.h"
#include "protocol/can_node.h"
#include "tests/protocol/handshake_fixture.h"

namespace zeropose {

inline CanFrame error_frame(std::uint32_t error_class) {
  CanFrame frame;
  frame.error = true;
  frame.id = error_class;
  frame.size = 8;
  return frame;
}

// Often to our own identifiers and with sizes that matter.
inline CanFrame random_frame(std::mt19937& random) {
  constexpr std::array<std::uint32_t, 10> bases = {0x000, 0x080, 0x180, 0x200, 0x280,
                                                   0x380, 0x480, 0x580, 0x600, 0x700};
  CanFrame frame;
  const auto draw = [&](std::uint32_t end) { return static_cast<std::uint32_t>(random() % end); };
  frame.id = draw(4) != 0 ? bases[draw(bases.size())] + (draw(8) != 0 ? 5 : draw(128)) : draw(2048);
  if (frame.id == 5) frame.id = 0;  // NMT has no node in its identifier
  frame.extended = random() % 8 == 0;
  frame.remote = random() % 8 == 0;
  frame.fd = random() % 8 == 0;
  frame.size = static_cast<std::uint8_t>(random() % 2 != 0 ? 8 : random() % (frame.fd ? 65 : 9));
  for (std::size_t i = 0; i < frame.size; ++i) frame.data[i] = static_cast<std::uint8_t>(random());
  return frame;
}

class CanNodeTest : public testing::Test {
 protected:
  struct Commit {
    std::uint32_t id, status, code;
    friend bool operator==(const Commit&, const Commit&) = default;
  };
  struct Emergency {
    std::uint32_t error, error_register, code, id, detail;
    friend bool operator==(const Emergency&, const Emergency&) = default;
  };

  CanNodeTest() {
    options.node = 5;
    start();
  }
  void start() {
    HandshakeOptions handshake_options;
    handshake_options.convention = Convention::kuka;
    handshake_options.epoch = 100;
    handshake.emplace(handshake_options);
    handshake->set_cell_state(ready_cell(), now);
    node.emplace(options, Convention::kuka);
    all_sent.clear();
    node->link_up(now);
    step();
  }
  CanCoding coding() const { return can_coding(options, Convention::kuka); }

  // What the loop does in a round.
  void step() {
    handshake->tick(now);
    node->tick(now);
    node->show(handshake->block(now));
    while (const auto frame = node->next_frame(now)) {
      all_sent.push_back(*frame);
      if (!bus_takes) return;
      node->take(*frame, true, now);
      node->show(handshake->block(now));
    }
  }
  void wait(int ms) {
    const TimePoint until = now + std::chrono::milliseconds(ms);
    while (now < until) {
      now += std::chrono::milliseconds(1);
      step();
    }
  }
  void take(const CanFrame& frame) {
    const CanTaken taken = node->take(frame, false, now);
    if (taken.command)
      node->answered(*taken.command, handshake->on_command(*taken.command, connection, now).verdict);
    if (taken.link_lost) handshake->on_disconnect(connection++, now);
    step();
  }
  void send_command(CommandKind kind, std::uint32_t id) {
    take(encode_can_command({id, K(kind), 1, 77, 0}, 5));
  }
  void measure(std::uint32_t id) { send_command(CommandKind::measure, id); }
  void report(std::uint32_t id, Code code) {
    Report report = ok_report(id, correction_x_mm);
    report.code = code;
    handshake->on_report(report, now);
    step();
  }
  void send_nmt(int what, int whom = 5) {
    CanFrame frame;
    frame.size = 2;
    frame.data[0] = static_cast<std::uint8_t>(what);
    frame.data[1] = static_cast<std::uint8_t>(whom);
    take(frame);
  }
  void send_sdo_read(std::uint32_t index, std::uint32_t sub) {
    CanFrame frame;
    frame.id = 0x605;
    frame.size = 8;
    put_le(frame.data, 0, 4, 0x40 | (index << 8) | (sub << 24));
    take(frame);
  }
  std::uint32_t read_by_sdo(std::uint32_t index, std::uint32_t sub) {
    send_sdo_read(index, sub);
    const CanFrame answer = of_id(0x585);
    EXPECT_EQ(answer.data[0] & 0xE0, 0x40);
    return get_le(answer.data, 4, 4);
  }
  void write_heartbeat(std::uint32_t ms) {
    CanFrame frame;
    frame.id = 0x605;
    frame.size = 8;
    put_le(frame.data, 0, 4, 0x0010172B);
    put_le(frame.data, 4, 4, ms);
    take(frame);
    EXPECT_EQ(of_id(0x585).data[0], 0x60);
  }

  // Between a Measure and its report.
  void disturb(std::uint32_t fault, std::uint32_t id) {
    switch (fault) {
      case 4:
        return take(of_id(0x185));  // somebody else sends our frame
      case 5:
        take(error_frame(0x40));
        return take(error_frame(0x100));
      case 6:
        node->link_down();
        handshake->on_disconnect(connection++, now);
        step();
        node->link_up(now);
        return step();
      case 7:
        return report(id, Code::too_few_marks);
      case 8:  // nobody listens for a while
        bus_takes = false;
        return;
      case 9:  // another command, which is refused
        return measure(id + 1);
      default:
        return;
    }
  }

  // The last one sent.
  CanFrame of_id(std::uint32_t id) const {
    for (auto frame = all_sent.rbegin(); frame != all_sent.rend(); ++frame)
      if (frame->id == id) return *frame;
    ADD_FAILURE() << "no frame " << std::hex << id;
    return {};
  }
  std::vector<std::uint32_t> ids_sent() const {
    std::vector<std::uint32_t> ids;
    for (const CanFrame& frame : all_sent) ids.push_back(frame.id);
    return ids;
  }
  // Also checks that the three frames belong together.
  Commit last_commit() const {
    const std::array<CanFrame, 3> frames = {of_id(0x185), of_id(0x285), of_id(0x385)};
    const auto result = decode_can_result(frames, handshake_epoch(), coding());
    if (!result) {
      ADD_FAILURE() << "the last three frames are no result";
      return {};
    }
    EXPECT_EQ(result->has(can_status::valid), result->values != no_can_values);
    return {result->request_id, result->status, result->code};
  }
  std::uint32_t handshake_epoch() const { return const_cast<Handshake&>(*handshake).block(now).epoch; }
  static Emergency emergency_in(const CanFrame& frame) {
    EXPECT_EQ(frame.size, 8);
    return {get_le(frame.data, 0, 2), get_le(frame.data, 2, 1), get_le(frame.data, 3, 2),
            get_le(frame.data, 5, 2), get_le(frame.data, 7, 1)};
  }
  Emergency last_emergency() const { return emergency_in(of_id(0x085)); }
  bool was_sent(const Emergency& emergency) const {
    return std::ranges::any_of(all_sent, [&](const CanFrame& frame) {
      return frame.id == 0x085 && emergency_in(frame) == emergency;
    });
  }

  // A robot that takes its result by the rules; the last word of every fault test.
  void expect_clean_cycle(std::uint16_t id) {
    CanResultCollector collector(coding());
    collector.expect(id, handshake_epoch());
    const std::size_t begin = all_sent.size();
    measure(id);
    report(id, Code::ok);
    std::optional<CanResult> result;
    for (std::size_t i = begin; i < all_sent.size(); ++i)
      if (const auto taken = collector.take(all_sent[i], now)) result = taken;
    ASSERT_TRUE(result);
    EXPECT_EQ(result->request_id, id);
    EXPECT_EQ(result->status, can_status::valid);
    EXPECT_EQ(result->values[0], static_cast<std::int16_t>(std::lround(correction_x_mm * 100)));
    send_command(CommandKind::acknowledge, id);
    EXPECT_EQ(last_commit(), (Commit{0, 0, 0}));
  }

  CanOptions options;
  TimePoint now = TimePoint() + std::chrono::hours(1);
  std::optional<Handshake> handshake;
  std::optional<CanNode> node;
  ConnectionId connection = 1;
  std::vector<CanFrame> all_sent;
  bool bus_takes = true;
  double correction_x_mm = 1.5;
};

}  // namespace zeropose
