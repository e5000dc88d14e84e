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

// The name and properties of its ticket; what the scene does not declare so was refused by the control plane.
TEST_F(PlayerRosterTest, ABodyBeginsWithItsPlayersNameAndProperties) {
  Scene scene = *WorldWithPlayers();
  scene.properties = {{"team", std::string("none")}, {"score", std::int64_t{0}}};
  CoreRig declared{1, std::make_shared<const Scene>(scene)};
  OrderedPlayer player = Here(kPlayer);
  player.name = "ann";
  player.properties = {{"team", std::string("red")}, {"wealth", std::int64_t{7}}};
  roster.Set(std::vector{player}, false, declared.region, declared.actions);
  declared.Step();
  const region::KeptRecord* record = declared.region.records().Find(PlayerBodyId(kPlayer));
  ASSERT_NE(record, nullptr);
  const auto set = PropertySet::Decode(*record->bytes, scene.properties);
  ASSERT_TRUE(set.ok()) << set.status();
  EXPECT_EQ(set->player_name(), "ann");
  EXPECT_EQ(ValueOf(scene.properties, {}, *set, "team"), PropertyValue(std::string("red")));
  EXPECT_EQ(ValueOf(scene.properties, {}, *set, "score"), PropertyValue(std::int64_t{0}));
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
