// The pictures of a camera on a robot's hand: from where, of which part, how old.
#include "daemon/pictures.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace zeropose {
namespace {

using namespace std::chrono_literals;
using testing::HasSubstr;

class Hands : public testing::Test {
 protected:
  Frame frame(std::uint8_t grey, TimePoint received = TimePoint(100s)) const {
    Frame frame;
    frame.width_px = 4, frame.height_px = 2, frame.stride_bytes = 4;
    frame.received = received;
    frame.pixels = own_pixels(std::vector<std::uint8_t>(8, grey));
    return frame;
  }
  void take(std::size_t position, std::uint32_t part, std::uint8_t grey = 1,
            const Pose& X_RH = Pose::Identity()) {
    hands.make_room(position, part, X_RH, TimePoint(50s), 3);
    const Frame taken[] = {frame(grey)};
    hands.take(position, taken);
  }
  static constexpr std::size_t none = 99;
  void take_all_but(std::size_t left_out, std::uint32_t part) {
    for (std::size_t position = 0; position < job.positions.size(); ++position)
      if (position != left_out) take(position, part);
  }
  std::string missing(std::optional<std::uint32_t> part, TimePoint now = TimePoint(100s)) const {
    return hands.missing(job, part, now);
  }

  const Cell cell = load_cell(ZEROPOSE_SOURCE_DIR "/config/cells/hand-camera.json");
  const Job& job = cell.jobs.front();
  HandPictures hands;
};

TEST_F(Hands, EveryPositionIsNeeded) {
  EXPECT_THAT(missing(7), HasSubstr("from front left along, front left across, front right along"));
  take_all_but(2, 7);
  EXPECT_EQ(missing(7), "no picture of this part from front right along");
  EXPECT_EQ(hands.rounds(job), 0u);
  take(2, 7);
  EXPECT_EQ(missing(7), "");
  EXPECT_EQ(missing({}), "");
  EXPECT_EQ(hands.rounds(job), 1u);
  hands.forget();
  EXPECT_NE(missing(7), "");
}

TEST_F(Hands, PicturesOfAnotherPartAreNoneAtAll) {
  take_all_but(none, 7);
  EXPECT_NE(missing(8), "");
  take(0, 8);
  EXPECT_THAT(missing(8), HasSubstr("from front left across, front right along"));
  EXPECT_NE(missing(7), "");
}

TEST_F(Hands, OldPicturesAreNamed) {
  take_all_but(none, 7);
  EXPECT_EQ(missing(7, TimePoint(129s)), "");
  EXPECT_THAT(missing(7, TimePoint(131s)), HasSubstr("front left along (too long ago)"));
}

TEST_F(Hands, RoundsAreKeptNewestFirstWhileTheHandComesBack) {
  for (std::uint8_t round = 1; round <= 5; ++round)
    for (std::size_t position = 0; position < job.positions.size(); ++position) take(position, 0, round);
  EXPECT_EQ(hands.rounds(job), 3u);
  EXPECT_EQ(hands.frames(job, 0)[2].row(0)[0], 5);
  EXPECT_EQ(hands.frames(job, 2)[2].row(1)[3], 3);
  const Pose elsewhere = from_six_numbers({0.2, 0, 0, 0, 0, 0});
  take(2, 0, 9, elsewhere);
  EXPECT_EQ(hands.rounds(job), 1u);
  EXPECT_EQ(hands.frames(job, 0)[2].row(0)[0], 9);
  EXPECT_TRUE(hands.hands(job)[2].isApprox(elsewhere));
}

// What was seen before must not pass for what could not be seen now.
TEST_F(Hands, APictureThatFailsLeavesNoneBehind) {
  take_all_but(none, 7);
  hands.make_room(2, 7, Pose::Identity(), TimePoint(50s), 1);
  EXPECT_EQ(missing(7), "no picture of this part from front right along");
}

TEST_F(Hands, OldRoundsGo) {
  hands.make_room(0, 0, Pose::Identity(), TimePoint(50s), 3);
  const Frame old[] = {frame(1, TimePoint(60s))};
  hands.take(0, old);
  hands.make_room(0, 0, Pose::Identity(), TimePoint(70s), 3);
  const Frame fresh[] = {frame(2)};
  hands.take(0, fresh);
  take_all_but(0, 0);
  EXPECT_EQ(hands.rounds(job), 1u);
  EXPECT_EQ(hands.frames(job, 0)[0].row(0)[0], 2);
}

// The hand came back, but not quite.
TEST_F(Hands, ANewPictureBelongsToTheNewPose) {
  const Pose again = from_six_numbers({0.05, 0, 0, 0, 0, 0});
  hands.make_room(0, 7, Pose::Identity(), TimePoint(50s), 1);
  const Frame first[] = {frame(1)};
  hands.take(0, first);
  take_all_but(0, 7);
  hands.make_room(0, 7, again, TimePoint(50s), 1);
  const Frame second[] = {frame(2)};
  hands.take(0, second);
  EXPECT_TRUE(hands.hands(job)[0].isApprox(again));
}

class Standings : public Hands {
 protected:
  Standing standing() const { return standing_of(cell, job, request); }
  void SetUp() override {
    request.kind = CommandKind::at_position;
    request.job = 1;
    request.argument = 2;
    request.X_RH = job.positions[1].X_RH;
  }
  Request request;
};

TEST_F(Standings, WhereItWasTaught) {
  EXPECT_EQ(standing().code, Code::ok) << standing().reason;
  EXPECT_EQ(standing().position, 1u);
  request.X_RH.translation().x() += 0.9;
  EXPECT_EQ(standing().code, Code::ok);
}

TEST_F(Standings, ElsewhereIsRefusedWithTheNumbers) {
  request.X_RH.translation().x() += 1.1;
  EXPECT_EQ(standing().code, Code::wrong_position);
  EXPECT_THAT(standing().reason, HasSubstr("the hand is 1.100 mm and 0.000 deg away from front left across"));
  request.X_RH =
      moved(job.positions[1].X_RH, (Vector6() << 0, 0, 0, 0.6 / degrees_per_radian, 0, 0).finished());
  EXPECT_EQ(standing().code, Code::wrong_position);
  request.X_RH = job.positions[2].X_RH;
  EXPECT_EQ(standing().code, Code::wrong_position);
}

TEST_F(Standings, OtherJobsIndicesAndCells) {
  request.job = 2;
  EXPECT_EQ(standing().code, Code::unknown_job);
  request.job = 0;  // as in a survey
  EXPECT_EQ(standing().code, Code::no_procedure);
  request.job = 1;
  for (const std::int32_t index : {0, -1, 9}) {
    request.argument = index;
    EXPECT_EQ(standing().code, Code::argument_out_of_range);
  }
  const Cell fixed = load_cell(ZEROPOSE_SOURCE_DIR "/config/cells/car-body.json");
  EXPECT_EQ(standing_of(fixed, fixed.jobs.front(), request).code, Code::no_procedure);
}

}  // namespace
}  // namespace zeropose
