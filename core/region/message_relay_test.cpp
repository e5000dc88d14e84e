// Messages between regions in a row, each with a standby that is two ticks behind.
#include "core/region/message_relay.h"

#include <gmock/gmock.h>

#include <map>
#include <memory>

#include "core/game/game_host.h"
#include "core/game/testing/scripted_game.h"
#include "core/region/log.h"
#include "core/region/region.h"
#include "core/region/region_state.h"
#include "core/region/testing/row_map.h"
#include "core/region/testing/small_world.h"
#include "game_sdk/api/api.h"

namespace tessera::region {
namespace {

using game::GameCalls;
using game::GameHost;
using game::GameValue;
using game::ScriptedGame;
using Arguments = ScriptedGame::Arguments;
using ::testing::ElementsAre;
using ::testing::IsEmpty;
using ::testing::Pair;

constexpr std::uint32_t kRowRegions = 4;
constexpr std::uint64_t kBehind = 2;  // ticks that standbys are

class MessageRelayTest : public ::testing::Test {
 protected:
  // Ball i lies in the middle of region i.
  void Begin(bool moves = false) {
    Scene scene = Balls({{5, 0, 0}, {15, 0, 0}, {25, 0, 0}, {35, 0, 0}});
    scene.bounds = {{0, -10, -10}, {10.0 * kRowRegions, 10, 10}};
    scene.kinds = {"", "ball"};
    scene.properties = {{"hits", std::int64_t{0}}};
    scene.instance_properties = {{"score", std::int64_t{0}}};
    for (BodyDef& body : scene.bodies) body.kind = 1;
    if (moves) {
      scene.bodies[3].initial.position.z = 3;
      scene.bodies[3].initial.linear_velocity = {-20, 0, 0};
    }
    scene_ = std::make_shared<const Scene>(std::move(scene));
    module_ = game.module();
    for (std::uint32_t i = 1; i <= kRowRegions; ++i) {
      auto host = GameHost::Load(module_, {"game.lua", "fine"}, scene_);
      ASSERT_TRUE(host.ok()) << host.status();
      Config config{RegionId(i), Incarnation(i), scene_, RowMap(kRowRegions), {}};
      config.game = *std::move(host);
      hosts.push_back(config.game);
      regions.push_back(std::make_unique<Region>(std::move(config)));
      regions.back()->SetStandby(true);
    }
    for (const auto& region : regions) Send(*region, region->Start());
  }
  void Send(const Region& from, const std::vector<OutgoingFrame>& frames) {
    for (const OutgoingFrame& frame : frames) {
      const absl::Status status = regions.at(frame.to.value() - 1)->Receive(from.id(), frame.bytes);
      EXPECT_TRUE(status.ok()) << status;
    }
  }
  void Step(std::uint64_t ticks = 1) {
    for (; ticks > 0; --ticks) {
      std::vector<StepResult> results;
      for (const auto& region : regions) {
        const std::uint64_t done = region->tick().value();
        if (standbys && done > kBehind) region->LogAcknowledged(Tick(done - kBehind));
        ASSERT_TRUE(region->CanStep());
        results.push_back(region->Step());
      }
      for (std::size_t i = 0; i < regions.size(); ++i) Send(*regions[i], results[i].frames);
      for (const auto& host : hosts) {
        for (const game::GameLine& line : host->TakeLines()) ADD_FAILURE() << line.text;
      }
    }
  }
  const Region& OwnerOf(std::uint64_t body) const {
    for (const auto& region : regions) {
      if (region->Owns(BodyId(body))) return *region;
    }
    return *regions.front();
  }
  static game::Mail MailOf(const Region& region, BodyId body) {
    const KeptRecord* record = region.records().Find(body);
    return record == nullptr ? game::Mail() : record->game.mail;
  }
  std::size_t LeftOver() const {
    std::size_t left = 0;
    for (const auto& region : regions) {
      for (const KeptRecord& record : region->records().all()) {
        const game::Mail& mail = record.game.mail;
        left += mail.outbox.size() + mail.inbox.size() + mail.senders.size();
      }
    }
    return left;
  }
  // Ball `from` sends to `to` in this tick, once.
  void SendAt(std::uint64_t tick, std::uint64_t from, std::uint64_t to) { orders_[{tick, from}] = to; }
  void OnTick() {
    game.On(game::kOnBodyTick, "ball", [this](GameCalls& calls, Arguments arguments) {
      calls.Call(game::kWorldTick, {});
      const auto tick = static_cast<std::uint64_t>(calls.result().as.whole);
      const auto order = orders_.find({tick, arguments[0].as.id});
      return order == orders_.end() || calls.Call(game::kBodySend, {BodyId(order->second), std::string("hi")});
    });
    game.On(game::kOnBodyMessage, "ball", [this](GameCalls& calls, Arguments arguments) {
      calls.Call(game::kWorldTick, {});
      applied.emplace_back(arguments[3].as.id, calls.result().as.whole);
      return true;
    });
  }

  ScriptedGame game;
  std::vector<std::unique_ptr<Region>> regions;
  std::vector<std::shared_ptr<GameHost>> hosts;
  std::vector<std::pair<std::uint64_t, std::int64_t>> applied;  // sender, tick
  bool standbys = true;                                         // they acknowledge

 private:
  std::shared_ptr<const Scene> scene_;
  tessera_game_module module_{};
  std::map<std::pair<std::uint64_t, std::uint64_t>, std::uint64_t> orders_;
};

TEST_F(MessageRelayTest, EachBorderAfterTheFirstTakesTwoTicks) {
  OnTick();
  Begin();
  SendAt(20, 1, 2);
  SendAt(20, 4, 1);
  SendAt(21, 3, 1);
  Step(40);
  EXPECT_THAT(applied, ElementsAre(Pair(1, 24), Pair(3, 27), Pair(4, 28)));
  std::uint64_t late = 0;
  for (const auto& host : hosts) late += host->statistics().messages.late;
  EXPECT_EQ(late, 0U);
  EXPECT_EQ(hosts[0]->statistics().messages.by_hops[3], 1U);
}

TEST_F(MessageRelayTest, NothingIsLeftOnceBothEndsAgree) {
  OnTick();
  Begin();
  for (std::uint64_t tick = 20; tick < 60; tick += 5) SendAt(tick, 1, 4);
  Step(80);
  EXPECT_EQ(applied.size(), 8U);
  EXPECT_GT(LeftOver(), 0U) << "the target remembers the sender";
  Step(400);
  EXPECT_EQ(LeftOver(), 0U);
  EXPECT_EQ(regions[0]->messages().repeated, 0U);
}

TEST_F(MessageRelayTest, AMessageWaitsForTheStandby) {
  OnTick();
  Begin();
  Step(15);
  standbys = false;
  SendAt(20, 1, 2);
  Step(40);
  EXPECT_THAT(applied, IsEmpty());
  standbys = true;
  Step(10);
  EXPECT_EQ(applied.size(), 1U);
}

TEST_F(MessageRelayTest, AMessageFollowsABodyThatGoesOn) {
  OnTick();
  Begin(true);  // ball 4 comes to region 3 within half a second, and to region 2 half a second later
  for (std::uint64_t tick = 2; tick < 90; ++tick) SendAt(tick, 1, 4);
  Step(200);
  ASSERT_EQ(applied.size(), 88U);
  for (std::size_t i = 0; i < applied.size(); ++i) EXPECT_EQ(applied[i].first, 1U);
  EXPECT_TRUE(std::ranges::is_sorted(applied, {}, [](const auto& one) { return one.second; }));
  std::uint64_t late = 0;
  for (const auto& host : hosts) late += host->statistics().messages.late;
  // With standbys as late as that, one that comes to a region just after the body has left it is a tick late.
  EXPECT_LE(late, 3U);
}

TEST_F(MessageRelayTest, AMessageToABodyThatIsGoneIsDropped) {
  OnTick();
  game.On(game::kOnBodyTick, "ball", [](GameCalls& calls, Arguments arguments) {
    calls.Call(game::kWorldTick, {});
    const std::int64_t tick = calls.result().as.whole;
    if (arguments[0].as.id == 2 && tick == 10) return calls.Call(game::kBodyRemove, {BodyId(2)});
    if (arguments[0].as.id == 1 && tick == 20) return calls.Call(game::kBodySend, {BodyId(2), std::string("hi")});
    return true;
  });
  Begin();
  Step(40);
  EXPECT_EQ(regions[0]->messages().refused, 1U);
  EXPECT_EQ(LeftOver(), 0U);
}

TEST_F(MessageRelayTest, ABodyThatSendsAndGoesIsHeard) {
  OnTick();
  game.On(game::kOnBodyTick, "ball", [](GameCalls& calls, Arguments arguments) {
    calls.Call(game::kWorldTick, {});
    if (arguments[0].as.id != 1 || calls.result().as.whole != 20) return true;
    return calls.Call(game::kBodySend, {BodyId(4), std::string("bye")}) && calls.Call(game::kBodyRemove, {BodyId(1)});
  });
  Begin();
  Step(21);
  EXPECT_FALSE(regions[0]->Owns(BodyId(1)));
  EXPECT_THAT(regions[0]->removed(), IsEmpty()) << "the standby does not have it";
  EXPECT_EQ(MailOf(*regions[0], BodyId(1)).outbox.size(), 1U);
  const auto saved = DecodeState(regions[0]->SaveState(), regions[0]->catalog());
  ASSERT_TRUE(saved.ok()) << saved.status();
  ASSERT_NE(saved->Find(BodyId(1)), nullptr) << "its message is under way";
  EXPECT_TRUE(saved->RecordOf(BodyId(1)).game.removed);
  Step(2);
  EXPECT_THAT(regions[0]->removed(), ElementsAre(BodyId(1)));
  Step(38);
  EXPECT_THAT(applied, ElementsAre(Pair(1, 28)));
  EXPECT_THAT(regions[0]->removed(), ElementsAre(BodyId(1)));
  const auto after = DecodeState(regions[0]->SaveState(), regions[0]->catalog());
  EXPECT_EQ(after->Find(BodyId(1)), nullptr);
  EXPECT_THAT(after->tombstones, ElementsAre(BodyClaim{BodyId(1), Epoch(1)}));
  Step(600);
  EXPECT_EQ(LeftOver(), 0U) << "the tombstone confirmed";
}

TEST_F(MessageRelayTest, AFunctionOfABodyElsewhereIsCarriedOutThere) {
  OnTick();
  game.On(game::kOnBodyTick, "ball", [](GameCalls& calls, Arguments arguments) {
    calls.Call(game::kWorldTick, {});
    if (arguments[0].as.id != 1 || calls.result().as.whole != 20) return true;
    return calls.Call(game::kBodyImpulse, {BodyId(2), Vec3d{0, 3, 0}}) &&
           calls.Call(game::kBodySet, {BodyId(3), std::string("hits"), std::int64_t{4}}) &&
           calls.Call(game::kBodyRemove, {BodyId(4)});
  });
  Begin();
  Step(24);
  EXPECT_EQ(regions[1]->owned()[0].state.linear_velocity.y, 0);
  Step(1);
  EXPECT_EQ(regions[1]->owned()[0].state.linear_velocity.y, 3) << "four ticks, and one for the push";
  Step(4);
  EXPECT_THAT(regions[3]->owned(), IsEmpty());
  const KeptRecord* record = regions[2]->records().Find(BodyId(3));
  ASSERT_NE(record, nullptr);
  const Scene& scene = regions[2]->catalog().scene();
  EXPECT_EQ(ValueOf(scene.properties, {}, *PropertySet::Decode(*record->bytes, scene.properties), "hits"),
            PropertyValue(std::int64_t{4}));
}

TEST_F(MessageRelayTest, TheWorldsPropertiesAreSeenEverywhereAfterAKnownTime) {
  std::map<std::uint64_t, std::int64_t> first_seen;  // by ball, which is its region
  game.On(game::kOnTick, "", [](GameCalls& calls, Arguments) {
    calls.Call(game::kWorldTick, {});
    const bool set = calls.result().as.whole == 20;
    calls.Call(game::kWorldIsOwn, {});
    if (!set || calls.result().as.whole == 0) return true;
    return calls.Call(game::kWorldSet, {std::string("score"), std::int64_t{3}});
  });
  game.On(game::kOnBodyTick, "ball", [&](GameCalls& calls, Arguments arguments) {
    calls.Call(game::kWorldGet, {std::string("score")});
    if (calls.result().as.whole != 3) return true;
    calls.Call(game::kWorldTick, {});
    first_seen.try_emplace(arguments[0].as.id, calls.result().as.whole);
    return true;
  });
  Begin();
  Step(40);
  // .37 of the way from west to east lies in region 2.
  EXPECT_THAT(first_seen, ElementsAre(Pair(1, 24), Pair(2, 20), Pair(3, 24), Pair(4, 26)));
}

}  // namespace
}  // namespace tessera::region
