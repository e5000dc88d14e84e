// Each begin once, each end once, in whatever order the updates come and whichever region sends them.
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
const RegionId kLeft{1}, kRight{2};

struct PairBookTest : testing::Test {
  // "+": began, "-": ended, in the order reported.
  std::string Settle(milliseconds later = milliseconds(0)) {
    now += later;
    std::vector<ClientEvent> events;
    book.Settle(
        now, [&](BodyId id) { return !hidden.contains(id); }, events);
    std::string reported;
    for (const ClientEvent& event : events) {
      const bool begin =
          event.kind == ClientEvent::Kind::kContactBegan || event.kind == ClientEvent::Kind::kTriggerEntered;
      EXPECT_NE(touching.contains({event.body, event.other}), begin) << "reported twice";
      if (begin) touching.insert({event.body, event.other});
      if (!begin) touching.erase({event.body, event.other});
      reported += begin ? '+' : '-';
    }
    return reported;
  }
  void Told(RegionId from, std::uint64_t tick, bool begin, const BodyPair& pair = kPair) {
    book.Take(now, from, Tick(tick), pair, begin);
  }
  static bool Nowhere(const BodyPair&) { return false; }

  PairBook book;
  TimePoint now{std::chrono::hours(1)};
  std::set<BodyId> hidden;
  std::set<std::pair<BodyId, BodyId>> touching;
};

TEST_F(PairBookTest, ABeginSaysWhereTheTwoMet) {
  const MeetingPoint met{{1, 2, 3}, {0, 1, 0}, 5};
  book.Take(now, kLeft, Tick(10), kPair, true, met);
  std::vector<ClientEvent> events;
  book.Settle(
      now, [](BodyId) { return true; }, events);
  book.Take(now, kLeft, Tick(12), kPair, false);
  book.Settle(
      now, [](BodyId) { return true; }, events);
  ASSERT_EQ(events.size(), 2u);
  EXPECT_EQ(events[0].contact, met);
  EXPECT_FALSE(events[1].contact.has_value());
}

TEST_F(PairBookTest, TellsWhatItIsToldAtOnce) {
  Told(kLeft, 10, true);
  EXPECT_EQ(Settle(), "+");
  EXPECT_EQ(Settle(), "");
  Told(kLeft, 12, false);
  Told(kLeft, 15, true);
  EXPECT_EQ(Settle(), "-+");
  Told(kLeft, 12, false);  // again
  Told(kLeft, 15, true);
  EXPECT_EQ(Settle(), "");
}

TEST_F(PairBookTest, NewsOfTwoRegionsAreBroughtIntoOrder) {
  Told(kRight, 20, false);  // the body has been handed over, and east is faster than west
  EXPECT_EQ(Settle(milliseconds(50)), "");
  Told(kRight, 30, true);
  Told(kLeft, 10, true);
  EXPECT_EQ(Settle(), "+-+");
}

TEST_F(PairBookTest, WhatNeverComesIsNotWaitedForLong) {
  Told(kRight, 20, false);
  Told(kRight, 30, true);
  EXPECT_EQ(Settle(), "");
  EXPECT_EQ(Settle(PairBook::kHold), "+");
  Told(kLeft, 10, true);  // too late
  EXPECT_EQ(Settle(PairBook::kHold), "");
  Told(kRight, 40, false);
  EXPECT_EQ(Settle(), "-");
  EXPECT_EQ(Settle(PairBook::kHold), "");
  EXPECT_EQ(book.size(), 0u);
}

TEST_F(PairBookTest, APairEndsForWhoDoesNotSeeIt) {
  hidden.insert(kPair.b);
  Told(kLeft, 10, true);
  EXPECT_EQ(Settle(), "");
  hidden.clear();
  EXPECT_EQ(Settle(), "+");
  hidden.insert(kPair.a);
  EXPECT_EQ(Settle(), "-");
  hidden.clear();
  EXPECT_EQ(Settle(milliseconds(500)), "+");  // it touches still
  hidden.insert(kPair.a);
  EXPECT_EQ(Settle(), "-");
  Told(kLeft, 20, false);
  hidden.clear();
  EXPECT_EQ(Settle(), "");
  hidden.insert(kZone.b);
  Told(kLeft, 30, true, kZone);
  EXPECT_EQ(Settle(), "");
  EXPECT_EQ(Settle(PairBook::kUnseen), "");
  EXPECT_EQ(book.size(), 0u);
}

TEST_F(PairBookTest, ARegionThatBeginsAnewTellsWhatWasMissed) {
  Told(kLeft, 10, true);
  Told(kLeft, 11, true, kZone);
  Told(kRight, 12, true, {BodyId(4), BodyId(9), false});
  EXPECT_EQ(Settle(), "+++");
  // The connection to west broke: one pair has ended meanwhile, one goes on, one has begun.
  book.TakeAll(now, kLeft, Tick(50), {kZone, {BodyId(5), BodyId(6), false}}, Nowhere);
  EXPECT_EQ(Settle().size(), 2u);
  EXPECT_FALSE(touching.contains({kPair.a, kPair.b}));
  EXPECT_TRUE(touching.contains({BodyId(5), BodyId(6)}));
  EXPECT_EQ(touching.size(), 3u);
  // West cannot end a pair that another region has by now.
  book.TakeAll(now, kLeft, Tick(60), {}, [](const BodyPair& pair) { return pair == kZone; });
  EXPECT_EQ(Settle(), "-");
  EXPECT_TRUE(touching.contains({kZone.a, kZone.b}));
  Told(kRight, 70, false, kZone);
  EXPECT_EQ(Settle(), "-");
}

TEST_F(PairBookTest, AWorldThatWentBackIsFollowed) {
  Told(kLeft, 1000, true);
  EXPECT_EQ(Settle(), "+");
  book.TakeAll(now, kLeft, Tick(500), {}, Nowhere);
  EXPECT_EQ(Settle(), "-");
  Told(kLeft, 510, true);
  EXPECT_EQ(Settle(), "+");
  book.TakeAll(now, kLeft, Tick(100), {kPair}, Nowhere);
  EXPECT_EQ(Settle(), "");
  Told(kLeft, 110, false);
  EXPECT_EQ(Settle(), "-");
}

// Two regions send one history in turn; the updates of each come in order, those of both together do not. Updates that
// have come by the time of a poll come out as they were. Some of the later ones may be left out, but nothing is
// reported twice, and the last state holds.
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
    std::string reported;
    while (!lanes[0].empty() || !lanes[1].empty()) {
      const std::size_t lane = lanes[0].empty() ? 1 : lanes[1].empty() ? 0 : random() % 2;
      const auto [tick, begin] = lanes[lane].front();
      lanes[lane].pop_front();
      Told(RegionId(static_cast<std::uint32_t>(lane + 1)), tick, begin);
      if (!at_once && random() % 2 == 0) reported += Settle(milliseconds(5));
    }
    reported += Settle();
    reported += Settle(PairBook::kHold);
    if (at_once) {
      ASSERT_EQ(reported, history) << "round " << round;
    }
    ASSERT_TRUE(touching.empty()) << "round " << round;
    ASSERT_GE(reported.size(), 2u);
    ASSERT_LE(reported.size(), history.size());
  }
}

// Somebody who joins in the middle of a zone has not walked into it.
TEST_F(PairBookTest, WhatARegionHadWhenItWasConnectedToIsToldApartFromWhatBegan) {
  const auto settle = [&] {
    std::vector<ClientEvent> events;
    book.Settle(
        now, [](BodyId) { return true; }, events);
    return events;
  };
  book.TakeAll(now, kLeft, Tick(10), {kZone}, Nowhere);
  const auto joined = settle();
  ASSERT_EQ(joined.size(), 1u);
  EXPECT_EQ(joined[0].kind, ClientEvent::Kind::kTriggerEntered);
  EXPECT_TRUE(joined[0].since_before);
  Told(kLeft, 12, false, kZone);
  Told(kLeft, 14, true, kZone);
  const auto walked = settle();
  ASSERT_EQ(walked.size(), 2u);
  EXPECT_EQ(walked[0].kind, ClientEvent::Kind::kTriggerLeft);
  EXPECT_FALSE(walked[0].since_before);
  EXPECT_EQ(walked[1].kind, ClientEvent::Kind::kTriggerEntered);
  EXPECT_FALSE(walked[1].since_before);
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
