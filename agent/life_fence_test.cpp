#include "agent/life_fence.h"

#include "gtest/gtest.h"

namespace tessera::agent {
namespace {

TEST(LifeFenceTest, KeepsOutWhatAnEarlierLifeOrders) {
  constexpr std::uint64_t kThird = std::uint64_t{3} << 32, kFourth = std::uint64_t{4} << 32;
  LifeFence fence;
  EXPECT_TRUE(fence.Admit(kThird + 7));
  EXPECT_TRUE(fence.Admit(kThird + 2)) << "the order within a life is another's matter";
  EXPECT_TRUE(fence.Admit(kFourth + 1));
  EXPECT_FALSE(fence.Admit(kThird + 99));
  EXPECT_TRUE(fence.Admit(kFourth + 2));
}

TEST(LifeFenceTest, GoesOnFromWhatTheHostHasSeen) {
  LifeFence fence(4);
  EXPECT_FALSE(fence.Admit((std::uint64_t{3} << 32) + 99));
  EXPECT_TRUE(fence.Admit((std::uint64_t{4} << 32) + 1));
  EXPECT_TRUE(fence.Admit((std::uint64_t{7} << 32) + 1));
  EXPECT_EQ(fence.newest(), 7u);
}

}  // namespace
}  // namespace tessera::agent
