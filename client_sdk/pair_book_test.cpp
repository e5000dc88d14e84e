// Each begin once, each end once, whatever order the news come in and whoever tells them.
#include "client_sdk/pair_book.h"

#include <gtest/gtest.h>

#include <deque>
#include <random>
#include <set>
#include <string>

#include "client_sdk/client_fixture.h"

namespace tessera::client {
namespace {

using std::chrono::milliseconds;

const BodyPair kPair{BodyId(3), BodyId(8), false};
const BodyPair kZone{BodyId(1), BodyId(8), true};
const RegionId kWest{1}, kEast{2};

struct PairBookTest : testing::Test {
  // "+": began, "-": ended, in the order told.
  std::string Settle(milliseconds later = milliseconds(0)) {
    now += later;
    std::vector<ClientEvent> events;
    book.Settle(
        now, [&](BodyId id) { return !hidden.contains(id); }, events);
    std::string told;
    for (const ClientEvent& event : events) {
      const bool begin =
          event.kind == ClientEvent::Kind::kContactBegan || event.kind == ClientEvent::Kind::kTriggerEntered;
      EXPECT_NE(touching.contains({event.body, event.other}), begin) << "told twice";
      if (begin) touching.insert({event.body, event.other});
      if (!begin) touching.erase({event.body, event.other});
      told += begin ? '+' : '-';
    }
    return told;
  }
  void Told(RegionId from, std::uint64_t tick, bool begin, const BodyPair& pair = kPair) {
    book.Told(now, from, Tick(tick), pair, begin);
  }
  static bool Nowhere(const BodyPair&) { return false; }

  PairBook book;
  TimePoint now{std::chrono::hours(1)};
  std::set<BodyId> hidden;
  std::set<std::pair<BodyId, BodyId>> touching;
};

TEST_F(PairBookTest, TellsWhatItIsToldAtOnce) {
  Told(kWest, 10, true);
  EXPECT_EQ(Settle(), "+");
  EXPECT_EQ(Settle(), "");
  Told(kWest, 12, false);
  Told(kWest, 15, true);
  EXPECT_EQ(Settle(), "-+");
  Told(kWest, 12, false);  // again
  Told(kWest, 15, true);
  EXPECT_EQ(Settle(), "");
}

TEST_F(PairBookTest, NewsOfTwoRegionsAreBroughtIntoOrder) {
  Told(kEast, 20, false);  // the body has been handed over, and east is faster than west
  EXPECT_EQ(Settle(milliseconds(50)), "");
  Told(kEast, 30, true);
  Told(kWest, 10, true);
  EXPECT_EQ(Settle(), "+-+");
}

TEST_F(PairBookTest, WhatNeverComesIsNotWaitedForLong) {
  Told(kEast, 20, false);
  Told(kEast, 30, true);
  EXPECT_EQ(Settle(), "");
  EXPECT_EQ(Settle(PairBook::kHold), "+");
  Told(kWest, 10, true);  // too late
  EXPECT_EQ(Settle(PairBook::kHold), "");
  Told(kEast, 40, false);
  EXPECT_EQ(Settle(), "-");
  EXPECT_EQ(Settle(PairBook::kHold), "");
  EXPECT_EQ(book.size(), 0u);
}

TEST_F(PairBookTest, APairEndsForWhoDoesNotSeeIt) {
  hidden.insert(kPair.b);
  Told(kWest, 10, true);
  EXPECT_EQ(Settle(), "");
  hidden.clear();
  EXPECT_EQ(Settle(), "+");
  hidden.insert(kPair.a);
  EXPECT_EQ(Settle(), "-");
  hidden.clear();
  EXPECT_EQ(Settle(milliseconds(500)), "+");  // it touches still
  hidden.insert(kPair.a);
  EXPECT_EQ(Settle(), "-");
  Told(kWest, 20, false);
  hidden.clear();
  EXPECT_EQ(Settle(), "");
  hidden.insert(kZone.b);
  Told(kWest, 30, true, kZone);
  EXPECT_EQ(Settle(), "");
  EXPECT_EQ(Settle(PairBook::kUnseen), "");
  EXPECT_EQ(book.size(), 0u);
}

TEST_F(PairBookTest, ARegionThatBeginsAnewTellsWhatWasMissed) {
  Told(kWest, 10, true);
  Told(kWest, 11, true, kZone);
  Told(kEast, 12, true, {BodyId(4), BodyId(9), false});
  EXPECT_EQ(Settle(), "+++");
  // The connection to west broke: one pair has ended meanwhile, one goes on, one has begun.
  book.ToldAll(now, kWest, Tick(50), {kZone, {BodyId(5), BodyId(6), false}}, Nowhere);
  EXPECT_EQ(Settle().size(), 2u);
  EXPECT_FALSE(touching.contains({kPair.a, kPair.b}));
  EXPECT_TRUE(touching.contains({BodyId(5), BodyId(6)}));
  EXPECT_EQ(touching.size(), 3u);
  // What another region has by now is not west's to end.
  book.ToldAll(now, kWest, Tick(60), {}, [](const BodyPair& pair) { return pair == kZone; });
  EXPECT_EQ(Settle(), "-");
  EXPECT_TRUE(touching.contains({kZone.a, kZone.b}));
  Told(kEast, 70, false, kZone);
  EXPECT_EQ(Settle(), "-");
}

TEST_F(PairBookTest, AWorldThatWentBackIsFollowed) {
  Told(kWest, 1000, true);
  EXPECT_EQ(Settle(), "+");
  book.ToldAll(now, kWest, Tick(500), {}, Nowhere);
  EXPECT_EQ(Settle(), "-");
  Told(kWest, 510, true);
  EXPECT_EQ(Settle(), "+");
  book.ToldAll(now, kWest, Tick(100), {kPair}, Nowhere);
  EXPECT_EQ(Settle(), "");
  Told(kWest, 110, false);
  EXPECT_EQ(Settle(), "-");
}

// Two regions tell one history in turn; each one's news come in order, theirs against the other's do not. What is here
// by the time of a poll comes out as it was; of what comes later still, some may be left out, but nothing is told twice
// and the last word stands.
TEST_F(PairBookTest, AnyInterleavingIsOneHistory) {
  std::mt19937_64 random(7);
  for (int round = 0; round < 400; ++round) {
    const bool at_once = round % 2 == 0;
    book = PairBook();
    touching.clear();
    std::deque<std::pair<std::uint64_t, bool>> lanes[2];
    std::string history;
    for (std::uint64_t tick = 1; tick <= 12; ++tick) {
      const bool begin = tick % 2 == 1;
      lanes[random() % 2].push_back({tick, begin});
      history += begin ? '+' : '-';
    }
    std::string told;
    while (!lanes[0].empty() || !lanes[1].empty()) {
      const std::size_t lane = lanes[0].empty() ? 1 : lanes[1].empty() ? 0 : random() % 2;
      const auto [tick, begin] = lanes[lane].front();
      lanes[lane].pop_front();
      Told(RegionId(static_cast<std::uint32_t>(lane + 1)), tick, begin);
      if (!at_once && random() % 2 == 0) told += Settle(milliseconds(5));
    }
    told += Settle();
    told += Settle(PairBook::kHold);
    if (at_once) {
      ASSERT_EQ(told, history) << "round " << round;
    }
    ASSERT_TRUE(touching.empty()) << "round " << round;
    ASSERT_GE(told.size(), 2u);
    ASSERT_LE(told.size(), history.size());
  }
}

class ClientPairTest : public ClientFixture {};

// The trigger is static: it is in the scene, and never among the bodies.
TEST_F(ClientPairTest, WhatARegionMissedToTellIsToldWhenItIsBack) {
  Make(1, "bodies { id: 40 motion: MOTION_STATIC trigger: true shape { sphere { radius: 1 } } } ");
  Join();
  Play();
  const std::vector<replication::BodyRecord> ball = {{kBall, Epoch(1), Moving(0, 0)}};
  Advance([&](Tick t) { instance->regions[0]->Snapshot(t, ball); });
  instance->regions[0]->TellPairs(tick, {{kBall, BodyId(40), true, true}});
  ASSERT_TRUE(Until([&] { return Count(ClientEvent::Kind::kTriggerEntered) == 1; }));
  EXPECT_EQ(Find(ClientEvent::Kind::kTriggerEntered)->body, kBall);
  EXPECT_EQ(Find(ClientEvent::Kind::kTriggerEntered)->other, BodyId(40));
  instance->Restart(0);
  instance->regions[0]->started = true;
  ASSERT_TRUE(Until([&] { return Count(ClientEvent::Kind::kRegionBack) == 1; }, true));
  Advance([&](Tick t) { instance->regions[0]->Snapshot(t, ball); });
  instance->regions[0]->TellPairs(tick, {}, true);
  ASSERT_TRUE(Until([&] { return Count(ClientEvent::Kind::kTriggerLeft) == 1; }));
  EXPECT_EQ(Count(ClientEvent::Kind::kTriggerEntered), 1);
}

}  // namespace
}  // namespace tessera::client
