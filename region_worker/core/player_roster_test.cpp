#include "region_worker/core/player_roster.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "region_worker/testing/core_rig.h"

namespace tessera::worker {
namespace {

using ::testing::SizeIs;

constexpr PlayerNumber kPlayer{1}, kNext{2};

class PlayerRosterTest : public ::testing::Test {
 protected:
  void Set(const std::vector<OrderedPlayer>& players, bool joins = false) {
    roster.Set(players, joins, rig.region, rig.actions);
  }
  void Step() {
    roster.RemoveLeft(rig.region);
    rig.Step();
    roster.CountSpawned(rig.region);
  }
  bool HasBody(PlayerNumber player) const { return rig.region.Owns(PlayerBodyId(player)); }
  static OrderedPlayer Here(PlayerNumber player) { return {.number = player, .spawn_region = CoreRig::kSelf}; }

  CoreRig rig{1, WorldWithPlayers()};
  PlayerRoster roster{true};
};

TEST_F(PlayerRosterTest, ABodyIsMadeOnceHoweverOftenItsPlayerIsNamed) {
  Set({Here(kPlayer)});
  Step();
  EXPECT_TRUE(HasBody(kPlayer));
  Set({Here(kPlayer)});
  Step();
  EXPECT_EQ(roster.spawned(), 1U);
}

TEST_F(PlayerRosterTest, ABodyThatAnotherRegionMakesIsNotMadeHere) {
  Set({{.number = kPlayer, .spawn_region = CoreRig::kOther}});
  Step();
  EXPECT_FALSE(HasBody(kPlayer));
}

TEST_F(PlayerRosterTest, WhoJoinsMakesNoBodyThatAnEarlierLifeHasMade) {
  Set({Here(kPlayer)}, true);
  Set({Here(kPlayer)});
  Step();
  EXPECT_FALSE(HasBody(kPlayer));
  EXPECT_EQ(roster.spawned(), 0U);
}

TEST_F(PlayerRosterTest, APlayerThatLeftIsExpelledOnceAndLosesItsBody) {
  Set({Here(kPlayer)});
  Step();
  OrderedPlayer left = Here(kPlayer);
  left.left = true;
  Set({left});
  Set({left});
  EXPECT_THAT(AllOf<ExpelPlayer>(rig.actions), SizeIs(1));
  Step();
  EXPECT_FALSE(HasBody(kPlayer));
}

TEST_F(PlayerRosterTest, AHigherGenerationReplacesTheOneBeforeOnce) {
  const auto of = [](std::uint64_t generation) {
    OrderedPlayer player = Here(kPlayer);
    player.generation = net::Generation(generation);
    return player;
  };
  Set({of(1)});
  Set({of(1)});
  EXPECT_THAT(AllOf<ReplacePlayer>(rig.actions), SizeIs(0));
  Set({of(3)});
  Set({of(3)});
  Set({of(2)});
  ASSERT_THAT(AllOf<ReplacePlayer>(rig.actions), SizeIs(1));
  EXPECT_EQ(AllOf<ReplacePlayer>(rig.actions)[0].player, kPlayer);
  EXPECT_EQ(AllOf<ReplacePlayer>(rig.actions)[0].generation, net::Generation(3));
  Step();
  EXPECT_TRUE(HasBody(kPlayer)) << "the body stays";
}

TEST_F(PlayerRosterTest, APlayerThatIsNamedNoMoreHasLeft) {
  Set({Here(kPlayer), Here(kNext)});
  Step();
  Set({Here(kNext)});
  Step();
  EXPECT_FALSE(HasBody(kPlayer));
  EXPECT_TRUE(HasBody(kNext));
}

}  // namespace
}  // namespace tessera::worker
