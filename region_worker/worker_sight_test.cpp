// Bodies and properties for a team, for a player or for servers alone, as raw clients of the real program see them:
// what somebody may not see is in no datagram that comes to them, from any region.
#include <gmock/gmock.h>

#include <algorithm>
#include <functional>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "core/replication/command.h"
#include "core/world/properties.h"
#include "region_worker/testing/worker_cluster.h"

namespace tessera::worker {
namespace {

// In each of two regions: a flag of the one team, one of the other, and what nobody may see; and a body for all.
constexpr char kSightScene[] = R"(
  name: "sight"
  bounds { min { x: -10 y: -2 z: -10 } max { x: 10 y: 10 z: 10 } }
  team_property: "team"
  properties { name: "team" text: "" }
  properties { name: "plan" number: 0 visible_to: VISIBILITY_TEAM }
  properties { name: "hint" number: 0 visible_to: VISIBILITY_PLAYER }
  properties { name: "secret" number: 0 visible_to: VISIBILITY_SERVERS }
  instance_properties { name: "turned" flag: false }
  bodies { id: 1 motion: MOTION_STATIC shape { plane { normal { y: 1 } } } }
  bodies {
    id: 10 kind: "flag" mass: 1 shape { sphere { radius: .5 } } pose { position { x: -5 y: .5 z: 3 } }
    visible_to: VISIBILITY_TEAM properties { name: "team" text: "red" }
  }
  bodies {
    id: 11 kind: "flag" mass: 1 shape { sphere { radius: .5 } } pose { position { x: 5 y: .5 z: 3 } }
    visible_to: VISIBILITY_TEAM properties { name: "team" text: "red" }
  }
  bodies {
    id: 20 kind: "flag" mass: 1 shape { sphere { radius: .5 } } pose { position { x: -5 y: .5 z: 6 } }
    visible_to: VISIBILITY_TEAM properties { name: "team" text: "blue" }
  }
  bodies {
    id: 21 kind: "flag" mass: 1 shape { sphere { radius: .5 } } pose { position { x: 5 y: .5 z: 6 } }
    visible_to: VISIBILITY_TEAM properties { name: "team" text: "blue" }
  }
  bodies {
    id: 30 kind: "trap" mass: 1 shape { sphere { radius: .5 } } pose { position { x: -5 y: .5 z: -6 } }
    visible_to: VISIBILITY_SERVERS
  }
  bodies {
    id: 31 kind: "trap" mass: 1 shape { sphere { radius: .5 } } pose { position { x: 5 y: .5 z: -6 } }
    visible_to: VISIBILITY_SERVERS
  }
  bodies {
    id: 40 kind: "sign" mass: 1 shape { sphere { radius: .5 } } pose { position { x: -5 y: .5 z: -3 } }
    properties { name: "team" text: "red" }
  }
  player {
    body { name: "player" kind: "player" mass: 80 shape { sphere { radius: 0.5 } } never_sleeps: true }
    spawn_points { x: -5 y: .5 z: 0 }
    spawn_points { x: 5 y: .5 z: 0 }
    max_force: 2000
    max_speed: 6
  }
)";
// The first command shows the traps to all and the sign to nobody.
constexpr char kSightGame[] = R"(
  function on_join(player)
    local body = player:body()
    body.team = player:number() == 1 and "red" or "blue"
    body.hint = 100 + player:number()
  end
  function on_command() world.send("turn") end
  function on_message() world.turned = true end
  kinds.sign = {
    on_tick = function(self)
      if world.tick() == 10 then self.plan, self.secret = 7, 9 end
      if world.turned then self:show_to("servers") end
    end,
  }
  kinds.trap = {
    on_tick = function(self)
      if world.turned then self:show_to("everyone") end
    end,
  }
)";

class WorkerSightTest : public ::testing::Test {
 protected:
  WorkerSightTest() : cluster_(2, kSightScene, {"--players", "2", "--game", WriteTestFile("sight.lua", kSightGame)}) {
    for (std::uint32_t player = 1; player <= 2; ++player) {
      for (std::uint32_t region = 1; region <= 2; ++region) clients_.push_back(cluster_.Join(region, player));
    }
  }
  bool Until(const std::function<bool()>& done) {
    return worker::Until({clients_[0].get(), clients_[1].get(), clients_[2].get(), clients_[3].get()}, done);
  }
  TestClient& client(std::uint32_t player, std::uint32_t region) { return *clients_[2 * (player - 1) + region - 1]; }
  // By any of the player's connections, of those that the scene has.
  std::set<std::uint64_t> EverSeen(std::uint32_t player) {
    std::set<std::uint64_t> seen;
    for (std::uint32_t region = 1; region <= 2; ++region) {
      for (const BodyId body : client(player, region).ever_seen) {
        if (!IsPlayerBody(body)) seen.insert(body.value());
      }
    }
    return seen;
  }
  // As the player was told, by any region; nothing where it was not.
  std::optional<PropertyValue> Told(std::uint32_t player, BodyId body, const std::string& name) {
    for (std::uint32_t region = 1; region <= 2; ++region) {
      const auto bytes = client(player, region).properties.find(body);
      if (bytes == client(player, region).properties.end()) continue;
      const auto set = PropertySet::Decode(bytes->second, cluster_.scene().properties);
      EXPECT_TRUE(set.ok()) << set.status();
      const auto& declared = cluster_.scene().properties;
      const auto property = std::ranges::find(declared, name, &PropertyDef::name);
      if (const PropertyValue* value = set->Find(static_cast<std::size_t>(property - declared.begin()))) return *value;
    }
    return std::nullopt;
  }

  WorkerCluster cluster_;
  std::vector<std::unique_ptr<TestClient>> clients_;
};

TEST_F(WorkerSightTest, WhatSomebodyMayNotSeeIsInNoDatagramOfAnyRegion) {
  using Ids = std::set<std::uint64_t>;
  const Ids red{10, 11, 40}, blue{20, 21, 40};
  const BodyId sign(40), first = PlayerBodyId(PlayerNumber(1)), second = PlayerBodyId(PlayerNumber(2));
  ASSERT_TRUE(Until([&] {
    return EverSeen(1).size() >= 3 && EverSeen(2).size() >= 3 && Told(1, sign, "plan") && Told(1, first, "hint") &&
           Told(2, second, "hint") && client(1, 1).tick > Tick(120) && client(2, 2).tick > Tick(120);
  }));
  EXPECT_EQ(EverSeen(1), red);
  EXPECT_EQ(EverSeen(2), blue);
  EXPECT_EQ(Told(1, sign, "plan"), PropertyValue(std::int64_t{7}));
  EXPECT_EQ(Told(2, sign, "plan"), std::nullopt) << "it is of the other team";
  for (const std::uint32_t player : {1U, 2U}) EXPECT_EQ(Told(player, sign, "secret"), std::nullopt);
  EXPECT_EQ(Told(1, first, "hint"), PropertyValue(std::int64_t{101}));
  EXPECT_EQ(Told(2, first, "hint"), std::nullopt);
  EXPECT_EQ(Told(1, second, "hint"), std::nullopt);
  EXPECT_EQ(Told(1, second, "team"), PropertyValue(std::string("blue"))) << "that is for everyone";

  ASSERT_TRUE(Until([&] {
    client(1, 1).SendDatagram(replication::EncodeCommands({.base = 1, .commands = {"turn"}}));
    return EverSeen(1).contains(30) && EverSeen(2).contains(30) && EverSeen(1).contains(31) &&
           EverSeen(2).contains(31) && !client(1, 1).bodies.contains(sign) && !client(2, 1).bodies.contains(sign);
  })) << testing::PrintToString(EverSeen(1))
      << testing::PrintToString(EverSeen(2));
  EXPECT_FALSE(EverSeen(1).contains(20) || EverSeen(1).contains(21));
  EXPECT_FALSE(EverSeen(2).contains(10) || EverSeen(2).contains(11));
}

}  // namespace
}  // namespace tessera::worker
