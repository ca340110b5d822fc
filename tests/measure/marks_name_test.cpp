#include <gtest/gtest.h>

#include <set>

#include "measure/marks.h"

namespace zeropose {
namespace {

TEST(MarkStatusName, EveryStatusHasItsOwn) {
  std::set<std::string_view> names;
  for (int s = 0; s <= static_cast<int>(MarkStatus::not_converged); ++s) {
    names.insert(name_of(static_cast<MarkStatus>(s)));
  }
  EXPECT_EQ(names.size(), static_cast<std::size_t>(MarkStatus::not_converged) + 1);
  EXPECT_FALSE(names.contains("unknown"));
}

TEST(MarkStatusName, FailingIsTheZeroValue) { EXPECT_EQ(name_of(MarkFinding{}.status), "not_searched"); }

}  // namespace
}  // namespace zeropose
