// Patterns: a reason for everything that is not found (spec 50 M0).
#include <gtest/gtest.h>

#include <cmath>

#include "tests/measure/pattern_scene.h"

namespace zeropose {
namespace {

using namespace zeropose::test;
using Eigen::Vector2d;

TEST(PatternReason, TwoOfThemAreAmbiguous) {
  std::mt19937_64 random(9);
  PatternScene scene = random_scene(18);
  const Pattern pattern = teach(expose(scene.taught_picture(), noise, random));
  const Picture one = cut(scene.taught_picture(), 8, 8, 45, 45);
  Picture two{140, 100, std::vector<double>(140 * 100, 115.0)};
  paste(one, 15, 20, two);
  MarkSearch search = search_for(pattern, {69.5, 49.5});
  search.half_window_px = {68, 48};
  EXPECT_EQ(find_pattern(expose(two, noise, random).view(), search).status, MarkStatus::found);
  paste(one, 80, 35, two);
  EXPECT_EQ(find_pattern(expose(two, noise, random).view(), search).status, MarkStatus::ambiguous);
}

struct OneScene {
  std::mt19937_64 random{10};
  PatternScene scene = random_scene(19);
  Pattern pattern = teach(expose(scene.taught_picture(), noise, random));
  Picture picture = scene.seen_picture();

  MarkStatus status(const MarkSearch& search) {
    return find_pattern(expose(picture, noise, random).view(), search).status;
  }
};

TEST(PatternReason, SearchesThatMakeNoSenseAreNotSearched) {
  OneScene one;
  MarkSearch search = search_for(one.pattern);
  ASSERT_EQ(one.status(search), MarkStatus::found);
  search.pattern = nullptr;
  EXPECT_EQ(one.status(search), MarkStatus::not_searched);
  const Pattern never;
  EXPECT_EQ(one.status(search_for(never)), MarkStatus::not_searched);
  EXPECT_EQ(one.status(search_for(one.pattern, {NAN, 0})), MarkStatus::not_searched);
}

TEST(PatternReason, BesideTheImageOrCutOff) {
  OneScene one;
  EXPECT_EQ(one.status(search_for(one.pattern, {-300, 50})), MarkStatus::outside_image);
  EXPECT_EQ(find_pattern(ImageView{}, search_for(one.pattern)).status, MarkStatus::outside_image);
  EXPECT_EQ(one.status(search_for(one.pattern, scene_middle, 15)), MarkStatus::cut_off);
  const Vector2d at = one.scene.truth(patch_middle);
  EXPECT_EQ(one.status(search_for(one.pattern, at + Vector2d(7, 0), 22)), MarkStatus::cut_off);
  const auto first = static_cast<int>(at.x()) - 14;
  one.picture = cut(one.picture, first, 0, scene_size - first, scene_size);
  EXPECT_EQ(one.status(search_for(one.pattern, at - Vector2d(first, 0), 45)), MarkStatus::cut_off);
}

TEST(PatternReason, NothingLikeIt) {
  OneScene one;
  fill(one.picture, 0, 0, scene_size, scene_size, 120);
  EXPECT_EQ(one.status(search_for(one.pattern)), MarkStatus::no_candidate);
  int found = 0;
  for (std::uint64_t seed = 300; seed < 310; ++seed) {
    one.picture = random_scene(seed).seen_picture();
    found += one.status(search_for(one.pattern)) == MarkStatus::found ? 1 : 0;
  }
  EXPECT_EQ(found, 0);
}

TEST(PatternReason, TooFaintTooLightTooSmallTooFarTurned) {
  OneScene one;
  MarkSearch search = search_for(one.pattern);
  search.min_contrast = 2 * one.pattern.contrast;
  EXPECT_EQ(one.status(search), MarkStatus::low_contrast);
  search = search_for(one.pattern);
  Picture light = one.picture;
  for (double& grey : light.grey) grey = 2.5 * grey - 20;
  one.picture = light;
  EXPECT_EQ(one.status(search), MarkStatus::saturated);
  one.scene.seen.linear = turned(0, 0.84);
  one.picture = one.scene.seen_picture();
  EXPECT_EQ(one.status(search), MarkStatus::too_small);
  one.scene.seen.linear = turned(0.6);
  one.picture = one.scene.seen_picture();
  EXPECT_NE(one.status(search), MarkStatus::found);
  search.direction_rad = 0.6;
  EXPECT_EQ(one.status(search), MarkStatus::found);
  search.direction_rad = 0;
  search.direction_tolerance_rad = 0.7;
  EXPECT_EQ(one.status(search), MarkStatus::found);
}

}  // namespace
}  // namespace zeropose
