#include "cli/table.h"

#include <gtest/gtest.h>

namespace tessera::cli {
namespace {

TEST(TableTest, AlignsTextLeftAndNumbersRight) {
  EXPECT_EQ(FormatTable({{"NAME", "OWNED"}, {"a", "7"}, {"longer", "1234"}}),
            "NAME    OWNED\n"
            "a           7\n"
            "longer   1234\n");
}

TEST(TableTest, NothingInNothingOut) { EXPECT_EQ(FormatTable({}), ""); }

TEST(TableTest, AgesGrowCoarser) {
  EXPECT_EQ(FormatAge(-1), "-");
  EXPECT_EQ(FormatAge(119), "119s");
  EXPECT_EQ(FormatAge(120), "2m");
  EXPECT_EQ(FormatAge(7200), "2h");
  EXPECT_EQ(FormatAge(200000), "2d");
}

TEST(TableTest, BytesArePowersOfThousand) {
  EXPECT_EQ(FormatBytes(999), "999B");
  EXPECT_EQ(FormatBytes(1234567), "1.2MB");
}

TEST(TableTest, CellsHoldNoSpaces) {
  for (const std::string& cell : {FormatBytes(12345), FormatMillis(0.0123), FormatAge(5)}) {
    EXPECT_EQ(cell.find(' '), std::string::npos) << cell;
  }
}

}  // namespace
}  // namespace tessera::cli
