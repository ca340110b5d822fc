// The SDO server, and that the files made from its table are the ones in the repository.
#include <gtest/gtest.h>

#include <fstream>
#include <set>
#include <sstream>

#include "protocol/can_sdo.h"

namespace zeropose {
namespace {

CanNodeState state_of_node() {
  CanNodeState state;
  state.coding.node = 5;
  state.block.epoch = 0xA1B2C3D4;
  state.block.request_id = 0x1234;
  state.block.state = LinkState::ready;
  state.block.status = status_bit::ready | status_bit::result_valid;
  state.block.values = {12340, -5000, 10, 10000, -20000, 10, invalid_value, invalid_value};
  state.block.config_hash = 0x11223344;
  state.block.convention = 2;
  return state;
}

CanFrame request(std::initializer_list<int> bytes) {
  CanFrame frame;
  frame.id = 0x605;
  frame.size = static_cast<std::uint8_t>(bytes.size());
  std::ranges::transform(bytes, frame.data.begin(), [](int byte) { return static_cast<std::uint8_t>(byte); });
  return frame;
}

CanFrame read_request(int index, int sub) {
  return request({0x40, index & 0xFF, index >> 8, sub, 0, 0, 0, 0});
}

std::vector<int> bytes_of(const SdoOutcome& outcome) {
  if (!outcome.answer) return {};
  EXPECT_EQ(outcome.answer->id, 0x585u);
  return {outcome.answer->bytes().begin(), outcome.answer->bytes().end()};
}

std::uint32_t abort_code(const SdoOutcome& outcome) {
  EXPECT_TRUE(outcome.aborted);
  EXPECT_FALSE(outcome.heartbeat_ms);
  const auto bytes = bytes_of(outcome);
  if (bytes.size() != 8 || bytes[0] != 0x80) return 0;
  return get_le(outcome.answer->data, 4, 4);
}

using V = std::vector<int>;

TEST(CanSdo, ReadsByTheBytes) {
  const CanNodeState state = state_of_node();
  EXPECT_EQ(bytes_of(answer_sdo(read_request(0x1000, 0), state)), (V{0x43, 0x00, 0x10, 0, 0, 0, 0, 0}));
  EXPECT_EQ(bytes_of(answer_sdo(read_request(0x1001, 0), state)), (V{0x4F, 0x01, 0x10, 0, 0, 0, 0, 0}));
  EXPECT_EQ(bytes_of(answer_sdo(read_request(0x1017, 0), state)), (V{0x4B, 0x17, 0x10, 0, 0xF4, 1, 0, 0}));
  EXPECT_EQ(bytes_of(answer_sdo(read_request(0x1018, 0), state)), (V{0x4F, 0x18, 0x10, 0, 4, 0, 0, 0}));
  EXPECT_EQ(bytes_of(answer_sdo(read_request(0x2001, 1), state)),
            (V{0x43, 0x01, 0x20, 1, 0xD4, 0xC3, 0xB2, 0xA1}));
  EXPECT_EQ(bytes_of(answer_sdo(read_request(0x2002, 2), state)),
            (V{0x43, 0x02, 0x20, 2, 0x78, 0xEC, 0xFF, 0xFF}));
  EXPECT_EQ(bytes_of(answer_sdo(read_request(0x2000, 1), state)), (V{0x43, 0x00, 0x20, 1, 0x10, 0x27, 0, 0}));
}

TEST(CanSdo, EveryObjectCanBeReadOrSaysThatItCannot) {
  const CanNodeState state = state_of_node();
  for (const CanObject& object : can_objects()) {
    const SdoOutcome outcome = answer_sdo(read_request(object.index, object.sub), state);
    if (object.access == CanAccess::pdo_only) {
      EXPECT_EQ(abort_code(outcome), sdo_abort::write_only);
    } else {
      ASSERT_TRUE(outcome.answer);
      EXPECT_EQ(outcome.answer->data[0], 0x43 | ((4 - object.size()) << 2));
      EXPECT_EQ(get_le(outcome.answer->data, 4, 4), object.read(state));
    }
  }
}

TEST(CanSdo, WithoutAValidResultNoValueIsRead) {
  CanNodeState state = state_of_node();
  state.block.status = status_bit::not_ok;
  for (std::uint8_t sub = 1; sub <= 6; ++sub) {
    EXPECT_EQ(get_le(answer_sdo(read_request(0x2002, sub), state).answer->data, 4, 4), 0x80000000u);
    EXPECT_EQ(get_le(answer_sdo(read_request(0x2200, sub + 1), state).answer->data, 4, 4), 0x8000u);
  }
}

TEST(CanSdo, WritesTheHeartbeatTime) {
  const auto sized = answer_sdo(request({0x2B, 0x17, 0x10, 0, 0xE8, 0x03, 0, 0}), state_of_node());
  EXPECT_EQ(bytes_of(sized), (V{0x60, 0x17, 0x10, 0, 0, 0, 0, 0}));
  EXPECT_EQ(sized.heartbeat_ms, 1000);
  const auto unsized = answer_sdo(request({0x22, 0x17, 0x10, 0, 0xE8, 0x03, 0, 0}), state_of_node());
  EXPECT_EQ(unsized.heartbeat_ms, 1000);
}

TEST(CanSdo, AbortsSayWhy) {
  struct Case {
    CanFrame request;
    std::uint32_t code;
  };
  const Case cases[] = {
      {read_request(0x1003, 0), 0x06020000},
      {read_request(0x2FFF, 1), 0x06020000},
      {read_request(0x1018, 5), 0x06090011},
      {read_request(0x1000, 1), 0x06090011},
      {read_request(0x2100, 1), 0x06010001},
      {request({0x23, 0x00, 0x10, 0, 1, 0, 0, 0}), 0x06010002},  // device type
      {request({0x2F, 0x18, 0x10, 0, 1, 0, 0, 0}), 0x06010002},  // number of entries
      {request({0x23, 0x02, 0x20, 1, 1, 0, 0, 0}), 0x06010002},  // a value of the result
      {request({0x2B, 0x00, 0x21, 1, 1, 0, 0, 0}), 0x08000021},  // the command, by SDO
      {request({0x2F, 0x17, 0x10, 0, 1, 0, 0, 0}), 0x06070010},  // one byte for two
      {request({0x23, 0x17, 0x10, 0, 1, 0, 0, 0}), 0x06070010},  // four bytes for two
      {request({0x21, 0x17, 0x10, 0, 2, 0, 0, 0}), 0x05040001},  // segmented download
      {request({0x00, 0, 0, 0, 0, 0, 0, 0}), 0x05040001},        // a segment
      {request({0x60, 0, 0, 0, 0, 0, 0, 0}), 0x05040001},        // the next segment
      {request({0xA0, 0x00, 0x10, 0, 0, 0, 0, 0}), 0x05040001},  // block upload
      {request({0xC0, 0x00, 0x10, 0, 0, 0, 0, 0}), 0x05040001},  // block download
      {request({0xE0, 0x00, 0x10, 0, 0, 0, 0, 0}), 0x05040001},
      {request({0x2B, 0x34, 0x12, 0, 0, 0, 0, 0}), 0x06020000},
      {request({0x2B, 0x17, 0x10, 1, 0, 0, 0, 0}), 0x06090011},
  };
  for (const Case& c : cases) {
    const SdoOutcome outcome = answer_sdo(c.request, state_of_node());
    EXPECT_EQ(abort_code(outcome), c.code) << std::hex << get_le(c.request.data, 0, 4);
    for (std::size_t i = 1; i < 4; ++i) EXPECT_EQ(outcome.answer->data[i], c.request.data[i]);
  }
}

TEST(CanSdo, WhatIsNoRequestGetsNoAnswer) {
  EXPECT_FALSE(answer_sdo(request({0x40, 0x00, 0x10, 0}), state_of_node()).answer);
  EXPECT_FALSE(answer_sdo(request({0x80, 0x00, 0x10, 0, 0, 0, 0, 0}), state_of_node()).answer);
}

TEST(CanDictionary, IsSortedAndEachPdoIsAsLongAsItsMapping) {
  const auto objects = can_objects();
  for (std::size_t i = 1; i < objects.size(); ++i) {
    EXPECT_LT(objects[i - 1].index * 256 + objects[i - 1].sub, objects[i].index * 256 + objects[i].sub);
    // Nothing between the first and the last sub-index is left out.
    if (objects[i].index == objects[i - 1].index) {
      EXPECT_EQ(objects[i].sub, objects[i - 1].sub + 1);
    } else {
      EXPECT_LE(objects[i].sub, 1);
    }
  }
  std::map<int, std::uint32_t> bits;
  for (const CanObject& object : objects) {
    if (object.index != 0x1600 && (object.index & 0xFFFC) != 0x1A00) continue;
    const std::uint32_t mapping = object.read({});
    const auto target =
        find_can_object(static_cast<std::uint16_t>(mapping >> 16), static_cast<std::uint8_t>(mapping >> 8));
    ASSERT_TRUE(target.object);
    EXPECT_TRUE(target.object->mappable);
    EXPECT_EQ(8 * target.object->size(), mapping & 0xFF);
    bits[object.index] += mapping & 0xFF;
  }
  EXPECT_EQ(bits, (std::map<int, std::uint32_t>{{0x1600, 64}, {0x1A00, 64}, {0x1A01, 64}, {0x1A02, 64}}));
}

TEST(CanDictionary, WithFdTheThreeFramesAreNotInUse) {
  CanNodeState state = state_of_node();
  EXPECT_EQ(find_can_object(0x1800, 1).object->read(state), 0x185u);
  state.fd = true;
  EXPECT_EQ(find_can_object(0x1800, 1).object->read(state), 0x80000185u);
}

std::string committed(const std::string& name) {
  std::ifstream file(std::string(ZEROPOSE_SOURCE_DIR) + "/" + name);
  std::ostringstream text;
  text << file.rdbuf();
  return text.str();
}

TEST(CanDictionary, TheEdsFileIsTheCodes) { EXPECT_EQ(committed("docs/robots/zeropose.eds"), eds_file()); }

TEST(CanDictionary, ThePagesTableIsTheCodes) {
  const std::string page = committed("docs/can.md");
  const std::string table =
      "by a test -->\n\n" + can_dictionary_markdown() + "\n<!-- end of object dictionary";
  EXPECT_NE(page.find(table), std::string::npos);
}

}  // namespace
}  // namespace zeropose
