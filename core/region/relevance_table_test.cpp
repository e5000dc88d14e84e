#include "core/region/relevance_table.h"

#include <gtest/gtest.h>

namespace tessera::region {
namespace {

TEST(RelevanceTableTest, EachBodyHasARowOfItsOwn) {
  RelevanceTable table;
  table.Reset(3, 2);
  EXPECT_FALSE(table.Any());
  table.Mark(1, 0);
  EXPECT_TRUE(table.To(1, 0));
  EXPECT_FALSE(table.To(1, 1) || table.ToAny(0) || table.ToAny(2));
  EXPECT_TRUE(table.ToAny(1) && table.Any());
  EXPECT_TRUE(table.Alike(0, 2));
  EXPECT_FALSE(table.Alike(0, 1));
  table.Reset(3, 2);
  EXPECT_FALSE(table.Any());
}

TEST(RelevanceTableTest, UnitedBodiesAreRelevantToWhomeverOneOfThemIs) {
  RelevanceTable table;
  table.Reset(4, 3);
  table.Mark(0, 0);
  table.Mark(2, 2);
  const std::size_t assembly[] = {0, 1, 2};
  table.Unite(assembly);
  EXPECT_TRUE(table.Alike(0, 1) && table.Alike(1, 2));
  EXPECT_TRUE(table.To(1, 0) && table.To(1, 2));
  EXPECT_FALSE(table.To(1, 1) || table.ToAny(3));
}

}  // namespace
}  // namespace tessera::region
