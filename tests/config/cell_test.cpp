#include "config/cell.h"

#include <gtest/gtest.h>

namespace zeropose {
namespace {

TEST(Cell, LoadsTheExample) {
  const Cell cell = load_cell(ZEROPOSE_SOURCE_DIR "/config/cells/car-body.json");
  EXPECT_EQ(cell.jobs.at(0).views.size(), 12U);
}

}  // namespace
}  // namespace zeropose
