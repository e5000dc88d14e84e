// Hosts for worlds that run a native game.
#include "control_plane/cluster/free_hosts.h"

#include <gmock/gmock.h>

#include "control_plane/testing/state_rig.h"

namespace tessera::control {
namespace {

using std::chrono::seconds;
using ::testing::HasSubstr;

const std::string kBuildA(64, 'a'), kBuildB(64, 'b');

class FreeHostsTest : public ::testing::Test {
 protected:
  HostEntry& AddHost(const std::string& name, const std::string& build, const std::string& failure = "") {
    HostEntry& host = rig_.AddHost(name, 2);
    if (build.empty() && failure.empty()) return host;
    records::Host next = host.record;
    v1::GameModule& module = *next.mutable_game_modules()->add_modules();
    module.set_name("arena");
    module.set_hash(build);
    module.set_failure(failure);
    EXPECT_TRUE(rig_.state->StoreHost(host, next).ok());
    return host;
  }
  absl::StatusOr<PlacementPlan> Places(std::uint32_t regions, const RegionNeeds& needs) {
    return PlaceAnew(*rig_.state, *MakeGridMap({0, 0, 100, 100}, regions), needs, nullptr, seconds(1), rig_.now);
  }

  StateRig rig_;
  const RegionNeeds arena_{.threads = 1, .module = "arena", .build = kBuildA};
};

TEST_F(FreeHostsTest, OnlyHostsWithThisBuildOfTheGameAreChosen) {
  const HostEntry& alpha = AddHost("alpha", kBuildA);
  AddHost("beta", "");
  AddHost("gamma", kBuildB);
  const HostEntry& delta = AddHost("delta", kBuildA);
  AddHost("epsilon", "", "is made for version 8 of the interface, and this is version 1");
  const auto placed = Places(4, arena_);
  ASSERT_TRUE(placed.ok()) << placed.status();
  for (const PlacedRegion& region : placed->regions) {
    EXPECT_TRUE(region.host_id == alpha.record.id() || region.host_id == delta.record.id()) << region.host_id;
  }
  EXPECT_EQ(FreeHosts(*rig_.state, {}, nullptr).size(), 5U) << "a world without one runs everywhere";
}

TEST_F(FreeHostsTest, WithoutRoomTheHostsThatLackItAreNamed) {
  AddHost("alpha", kBuildA);
  AddHost("beta", "");
  const absl::Status status = Places(3, arena_).status();
  EXPECT_EQ(status.code(), absl::StatusCode::kResourceExhausted);
  EXPECT_EQ(status.message(),
            "3 regions need 3 places; the 1 ready host has 2 free; without native:arena@aaaaaaaa: beta (has no such "
            "game module)");
}

TEST_F(FreeHostsTest, WhereNoHostHasItEachSaysWhy) {
  AddHost("alpha", kBuildB);
  AddHost("beta", "");
  AddHost("gamma", "", "is made for version 8 of the interface, and this is version 1");
  const absl::Status status = Places(1, arena_).status();
  EXPECT_EQ(status.code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_EQ(status.message(),
            "no host that takes regions has native:arena@aaaaaaaa: alpha (has build bbbbbbbb), beta (has no such game "
            "module), gamma (is made for version 8 of the interface, and this is version 1)");
}

TEST_F(FreeHostsTest, AHostWithoutFreePortsIsTakenLast) {
  HostEntry& alpha = AddHost("alpha", kBuildA);
  const HostEntry& beta = AddHost("beta", kBuildA);
  const std::uint32_t room = FreeHosts(*rig_.state, arena_, nullptr)[1].free;
  alpha.no_ports_until = rig_.now.steady + seconds(600);
  EXPECT_TRUE(FreeHosts(*rig_.state, arena_, nullptr)[0].avoided);
  const auto elsewhere = Places(room, arena_);
  ASSERT_TRUE(elsewhere.ok()) << elsewhere.status();
  for (const PlacedRegion& region : elsewhere->regions) EXPECT_EQ(region.host_id, beta.record.id());
  const auto both = Places(room + 1, arena_);
  ASSERT_TRUE(both.ok()) << both.status();
}

TEST_F(FreeHostsTest, OfManyHostsTheFirstAreNamed) {
  for (int i = 10; i < 30; ++i) AddHost("host" + std::to_string(i), "");
  EXPECT_THAT(std::string(Places(1, arena_).status().message()), HasSubstr("game module) and 12 more"));
}

TEST_F(FreeHostsTest, TheOnlyBuildIsTaken) {
  AddHost("alpha", kBuildA);
  AddHost("beta", kBuildA);
  AddHost("gamma", "", "cannot be loaded");
  EXPECT_EQ(*BuildOfModule(*rig_.state, {.module = "arena"}), kBuildA);
  EXPECT_THAT(std::string(BuildOfModule(*rig_.state, {.module = "plaza"}).status().message()),
              HasSubstr("no host that takes regions has native:plaza: alpha (has no such game module)"));
}

// A library may be a game, have a movement for one in Lua, or both.
TEST_F(FreeHostsTest, ALibraryIsNotTakenForWhatItLacks) {
  HostEntry& alpha = AddHost("alpha", kBuildA);
  const RegionNeeds movement{.threads = 1, .module = "arena", .build = kBuildA, .movement = true};
  EXPECT_THAT(std::string(Places(1, movement).status().message()), HasSubstr("alpha (it has no movement)"));
  records::Host next = alpha.record;
  next.mutable_game_modules()->mutable_modules(0)->set_movement(true);
  ASSERT_TRUE(rig_.state->StoreHost(alpha, next).ok());
  EXPECT_TRUE(Places(1, movement).ok());
  EXPECT_TRUE(Places(1, arena_).ok());
  next.mutable_game_modules()->mutable_modules(0)->set_no_game(true);
  ASSERT_TRUE(rig_.state->StoreHost(alpha, next).ok());
  EXPECT_TRUE(Places(1, movement).ok());
  EXPECT_THAT(std::string(Places(1, arena_).status().message()), HasSubstr("alpha (it has a movement alone, "));
}

TEST_F(FreeHostsTest, OfDifferentBuildsOneHasToBeChosen) {
  AddHost("alpha", kBuildA);
  AddHost("beta", kBuildB);
  const absl::Status status = BuildOfModule(*rig_.state, {.module = "arena"}).status();
  EXPECT_EQ(status.code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_THAT(std::string(status.message()),
              HasSubstr("different builds of native:arena; give one of them after '@': " + kBuildA + " on alpha; " +
                        kBuildB + " on beta"));
}

}  // namespace
}  // namespace tessera::control
