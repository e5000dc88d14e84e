#include "tests/simulation/invariant_checker.h"

#include <gmock/gmock.h>

#include "tests/simulation/instance.h"

namespace tessera::simulation {
namespace {

using ::testing::IsEmpty;
using ::testing::SizeIs;

class InvariantCheckerTest : public testing::Test {
 protected:
  void Owns(std::uint32_t region, std::uint64_t tick, std::uint32_t epoch) {
    const region::OwnedBody body{&scene_->bodies.back(), Epoch(epoch), {}};
    invariants_.Stepped(RegionId(region), Tick(tick), {&body, 1}, {});
  }

  const std::shared_ptr<const Scene> scene_ = Swarm(10, 1).Build();
  InvariantChecker invariants_{*scene_};
};

TEST_F(InvariantCheckerTest, ABodyThatTwoOwnAtOneTickIsReported) {
  Owns(1, 5, 1);
  Owns(2, 5, 2);
  EXPECT_THAT(invariants_.problems(), SizeIs(1));
  EXPECT_EQ(invariants_.doubled(), 1U);
}

TEST_F(InvariantCheckerTest, WhatTheDeadHandedToEachOtherUnheardBindsNobody) {
  Owns(1, 5, 1);
  Owns(2, 6, 2);
  Owns(3, 7, 3);
  for (const std::uint32_t dead : {1u, 2u, 3u}) invariants_.Died(RegionId(dead));
  Owns(4, 20, 2);
  EXPECT_THAT(invariants_.problems(), IsEmpty());
  Owns(5, 20, 3);
  EXPECT_EQ(invariants_.doubled(), 1U);
}

TEST_F(InvariantCheckerTest, TheDeadExcuseNoTwoThatLive) {
  Owns(1, 5, 1);
  Owns(2, 6, 2);
  invariants_.Died(RegionId(1));
  Owns(3, 7, 2);
  EXPECT_EQ(invariants_.doubled(), 1U);
}

}  // namespace
}  // namespace tessera::simulation
