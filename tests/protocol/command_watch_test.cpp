#include "protocol/command_watch.h"

#include <gtest/gtest.h>

namespace zeropose {
namespace {

using Sight = CommandWatch::Sight;

CommandRegisters measure(std::uint32_t id) { return encode_command({id, 1, 5, 6, 0}); }

CommandWatch started(const CommandRegisters& first_look = {}) {
  CommandWatch watch;
  watch.start(first_look);
  return watch;
}

TEST(CommandWatch, ANewCommandIsSeenOnce) {
  CommandWatch watch = started();
  EXPECT_EQ(watch.look({}), Sight::nothing);
  EXPECT_EQ(watch.look(measure(7)), Sight::command);
  EXPECT_EQ(watch.command(), (Command{7, 1, 5, 6, 0}));
  EXPECT_EQ(watch.look(measure(7)), Sight::nothing);
  EXPECT_EQ(watch.look(encode_command({7, 2, 0, 0, 0})), Sight::command);  // acknowledges with the same id
  EXPECT_EQ(watch.look(measure(8)), Sight::command);
}

TEST(CommandWatch, WhatStoodThereIsNeverACommand) {
  CommandWatch watch = started(measure(7));
  EXPECT_EQ(watch.look(measure(7)), Sight::nothing);
  EXPECT_EQ(watch.look(encode_command({7, 2, 0, 0, 0})), Sight::nothing);
  EXPECT_EQ(watch.look(measure(8)), Sight::command);
  EXPECT_EQ(watch.look(measure(7)), Sight::nothing);
  watch.start(measure(8));
  EXPECT_EQ(watch.look(measure(8)), Sight::nothing);
  EXPECT_EQ(watch.look(measure(7)), Sight::command);  // the handshake decides whether an id may come again
}

TEST(CommandWatch, AHalfWrittenBlockAtTheFirstLookIsNotCompletedIntoACommand) {
  CommandRegisters half = measure(7);
  half[9] ^= 0xFFFF;
  CommandWatch watch = started(half);
  EXPECT_EQ(watch.look(measure(7)), Sight::nothing);
  EXPECT_EQ(watch.look(measure(8)), Sight::command);
}

// Register by register, as a robot program writes, and looked at after each.
TEST(CommandWatch, ACommandWrittenInPiecesIsSeenWhenItIsWhole) {
  CommandRegisters now = encode_command({0x00010002, 1, 1, 2, 3});
  CommandWatch watch = started(now);
  const CommandRegisters next = encode_command({0x00030004, 3, 2, 0x00050006, zero_guard});
  for (std::size_t i = 0; i + 1 < now.size(); ++i) {
    now[i] = next[i];
    EXPECT_EQ(watch.look(now), Sight::nothing) << i;
  }
  EXPECT_EQ(watch.look(next), Sight::command);
}

TEST(CommandWatch, AWrongCrcIsToldOnceWhenItStays) {
  CommandWatch watch = started();
  CommandRegisters wrong = measure(7);
  wrong[4] ^= 1;
  EXPECT_EQ(watch.look(wrong), Sight::nothing);
  EXPECT_EQ(watch.look(wrong), Sight::wrong_crc);
  EXPECT_EQ(watch.look(wrong), Sight::nothing);
  EXPECT_EQ(watch.look(measure(7)), Sight::command);
}

TEST(CommandWatch, WithoutACrcItTakesTwoLooksAlike) {
  CommandWatch watch(false);
  watch.start({});
  CommandRegisters simple = measure(7);
  simple[8] = simple[9] = 0;
  EXPECT_EQ(watch.look(simple), Sight::nothing);
  simple[7] = 5;
  EXPECT_EQ(watch.look(simple), Sight::nothing);
  EXPECT_EQ(watch.look(simple), Sight::command);
  EXPECT_EQ(watch.command().argument, 5);
  EXPECT_EQ(watch.look(simple), Sight::nothing);
}

TEST(CommandWatch, RequestIdZeroIsNoCommand) {
  CommandWatch watch = started(measure(3));
  EXPECT_EQ(watch.look(measure(0)), Sight::nothing);
  EXPECT_EQ(watch.look(measure(0)), Sight::nothing);
}

}  // namespace
}  // namespace zeropose
