#include "client_sdk/world_view.h"

#include <gtest/gtest.h>

#include <numbers>

namespace tessera::client {
namespace {

using replication::ReceivedSnapshot;
constexpr RegionId kWest{1}, kEast{2};
constexpr BodyId kSeenBall{7};
const TimePoint kNow{std::chrono::hours(1)};

BodyState StateAt(double x, float speed = 0) {
  BodyState state;
  state.position.x = x;
  state.linear_velocity.x = speed;
  return state;
}

struct WorldViewTest : testing::Test {
  void Body(RegionId from, std::uint64_t tick, std::uint32_t epoch, const BodyState& state) {
    ReceivedSnapshot snapshot;
    snapshot.tick = Tick(tick);
    snapshot.bodies.push_back({kSeenBall, Epoch(epoch), state});
    view.Take(kNow, from, snapshot, events);
  }
  void Properties(RegionId from, std::uint64_t tick, std::uint32_t epoch, std::uint8_t value) {
    ReceivedSnapshot snapshot;
    snapshot.tick = Tick(tick);
    snapshot.bodies.push_back(
        {kSeenBall, Epoch(epoch), {}, std::make_shared<const replication::Bytes>(replication::Bytes{0, value})});
    view.Take(kNow, from, snapshot, events);
  }
  // 0: none.
  int Value() const {
    const auto& properties = view.bodies().at(kSeenBall).properties;
    return properties == nullptr ? 0 : properties->at(1);
  }
  int Changes() const {
    return static_cast<int>(std::count_if(events.begin(), events.end(), [](const ClientEvent& event) {
      return event.kind == ClientEvent::Kind::kPropertyChanged;
    }));
  }
  void Departs(RegionId from, std::uint64_t tick, std::uint32_t epoch, RegionId to) {
    ReceivedSnapshot snapshot;
    snapshot.tick = Tick(tick);
    snapshot.departures.push_back({kSeenBall, Epoch(epoch), to});
    view.Take(kNow, from, snapshot, events);
  }
  const SeenBody* Ball() const {
    const auto found = view.bodies().find(kSeenBall);
    return found == view.bodies().end() ? nullptr : &found->second;
  }
  int Count(ClientEvent::Kind kind) const {
    return static_cast<int>(
        std::count_if(events.begin(), events.end(), [&](const ClientEvent& e) { return e.kind == kind; }));
  }
  double ShownAt(double tick) { return view.At(tick, 60).at(0).pose.position.x; }

  WorldView view{60, 2, {{"lives", std::int64_t{3}}}};
  std::vector<ClientEvent> events;
};

// Between two states with another count of jumps it did not move.
TEST_F(WorldViewTest, AJumpIsNotShownAsMotion) {
  Body(kWest, 10, 1, StateAt(0, 60));
  Body(kWest, 12, 1, StateAt(2, 60));
  ReceivedSnapshot snapshot;
  snapshot.tick = Tick(14);
  snapshot.bodies.push_back({kSeenBall, Epoch(1), StateAt(100, 60), nullptr, {.jumps = 1, .tuning = {}}});
  view.Take(kNow, kWest, snapshot, events);
  EXPECT_DOUBLE_EQ(ShownAt(11), 1);
  EXPECT_DOUBLE_EQ(ShownAt(13), 2);
  EXPECT_DOUBLE_EQ(ShownAt(13.99), 2);
  EXPECT_DOUBLE_EQ(ShownAt(14), 100);
  EXPECT_EQ(Ball()->jumps, 1);
}

TEST_F(WorldViewTest, PropertiesStayUntilOthersAreTold) {
  Body(kWest, 10, 1, StateAt(0));
  EXPECT_EQ(Value(), 0);
  Properties(kWest, 12, 1, 5);
  Body(kWest, 14, 1, StateAt(1));
  EXPECT_EQ(Value(), 5);
  EXPECT_EQ(Changes(), 1);
  EXPECT_EQ(events.back().property, "lives");
  Properties(kEast, 16, 2, 5);
  EXPECT_EQ(Changes(), 1) << "the next owner sends the same";
  Properties(kWest, 18, 1, 9);
  EXPECT_EQ(Value(), 5) << "an ownership that has ended";
}

// A standby that had not heard of the last change goes on without it.
TEST_F(WorldViewTest, ANewOwnerThatTellsOfNoPropertiesHasNone) {
  Properties(kWest, 10, 1, 5);
  EXPECT_EQ(Changes(), 0) << "it appeared so";
  Body(kEast, 14, 2, StateAt(0));
  EXPECT_EQ(Value(), 0);
  EXPECT_EQ(Changes(), 1);
}

TEST_F(WorldViewTest, TheHigherEpochCountsThenTheLaterTick) {
  Body(kWest, 10, 1, StateAt(1));
  Body(kWest, 8, 1, StateAt(2));  // late
  EXPECT_EQ(Ball()->state.position.x, 1);
  Body(kEast, 9, 2, StateAt(3));  // an earlier tick, of a newer ownership
  EXPECT_EQ(Ball()->state.position.x, 3);
  EXPECT_EQ(Ball()->region, kEast);
  Body(kWest, 12, 1, StateAt(4));
  EXPECT_EQ(Ball()->state.position.x, 3);
  EXPECT_EQ(Count(ClientEvent::Kind::kAppeared), 1);
}

TEST_F(WorldViewTest, AHandoverNeitherVanishesNorAppears) {
  view.RegionBegins(kNow, kWest);
  view.RegionBegins(kNow, kEast);
  Body(kWest, 10, 1, StateAt(1));
  Departs(kWest, 12, 1, kEast);
  EXPECT_NE(Ball(), nullptr);
  EXPECT_EQ(Ball()->region, kEast);  // inputs must go there from now on
  Body(kEast, 12, 2, StateAt(2));
  view.Expire(kNow + std::chrono::hours(1), events);
  EXPECT_NE(Ball(), nullptr);
  EXPECT_EQ(events.size(), 1u);
}

TEST_F(WorldViewTest, ANewOwnerMayBeHeardBeforeTheOldOneTakesLeave) {
  Body(kWest, 10, 1, StateAt(1));
  Body(kEast, 12, 2, StateAt(2));
  Departs(kWest, 12, 1, kEast);
  view.Expire(kNow + std::chrono::hours(1), events);
  EXPECT_EQ(Ball()->state.position.x, 2);
  EXPECT_EQ(events.size(), 1u);
}

TEST_F(WorldViewTest, ABodyThatNobodyPromotesVanishesAfterAWhile) {
  view.RegionBegins(kNow, kEast);
  Body(kWest, 10, 1, StateAt(1));
  Departs(kWest, 12, 1, kEast);
  view.Expire(kNow + WorldView::kGrace / 2, events);
  EXPECT_NE(Ball(), nullptr);
  view.Expire(kNow + WorldView::kGrace, events);
  EXPECT_EQ(Ball(), nullptr);
  EXPECT_EQ(Count(ClientEvent::Kind::kVanished), 1);
}

// Its next owner may be too far away to be listened to.
TEST_F(WorldViewTest, ABodyHandedToWhomNobodyListensToVanishesInTheEnd) {
  view.RegionBegins(kNow, kWest);
  Body(kWest, 10, 1, StateAt(1));
  Departs(kWest, 12, 1, kEast);
  view.Expire(kNow + WorldView::kGrace, events);
  EXPECT_NE(Ball(), nullptr) << "a connection may be under way";
  view.Expire(kNow + WorldView::kOrphaned, events);
  EXPECT_EQ(Ball(), nullptr);
  EXPECT_EQ(Count(ClientEvent::Kind::kVanished), 1);
}

TEST_F(WorldViewTest, ABodyHandedToWhomAConnectionIsBrokenStays) {
  view.RegionBegins(kNow, kEast);
  view.RegionLost(kEast);
  Body(kWest, 10, 1, StateAt(1));
  Departs(kWest, 12, 1, kEast);
  view.Expire(kNow + WorldView::kOrphaned, events);
  EXPECT_NE(Ball(), nullptr);
}

TEST_F(WorldViewTest, NoMoreBodiesAreKeptThanThereAre) {
  WorldView small(60, 2, {}, 2);
  ReceivedSnapshot snapshot;
  snapshot.tick = Tick(1);
  for (std::uint64_t id = 1; id <= 3; ++id) snapshot.bodies.push_back({BodyId(id), Epoch(1), {}});
  small.Take(kNow, kWest, snapshot, events);
  EXPECT_EQ(small.bodies().size(), 2u);
  EXPECT_EQ(small.At(1, 60).size(), 2u);
}

TEST_F(WorldViewTest, ARemovedBodyVanishesAtOnceAndStaysAway) {
  Body(kWest, 10, 1, StateAt(1));
  Body(kEast, 12, 2, StateAt(2));
  Departs(kEast, 14, 2, RegionId());
  EXPECT_EQ(Ball(), nullptr);
  Body(kWest, 11, 1, StateAt(1));  // late; that ownership ended long ago
  Body(kEast, 13, 2, StateAt(2));
  EXPECT_EQ(Ball(), nullptr);
  EXPECT_EQ(Count(ClientEvent::Kind::kVanished), 1);
  Body(kWest, 20, 3, StateAt(5));
  EXPECT_NE(Ball(), nullptr);
}

TEST_F(WorldViewTest, ARegionThatBeginsAnewNamesWhatItStillHas) {
  view.RegionBegins(kNow, kWest);
  Body(kWest, 10, 1, StateAt(1));
  view.RegionLost(kWest);
  view.Expire(kNow + std::chrono::hours(1), events);
  EXPECT_NE(Ball(), nullptr);  // stands still while its region is silent
  view.RegionBegins(kNow, kWest);
  view.Expire(kNow + WorldView::kGrace, events);
  EXPECT_EQ(Ball(), nullptr);
}

TEST_F(WorldViewTest, BetweenTwoStatesItIsBetweenThem) {
  Body(kWest, 10, 1, StateAt(0, 6));
  Body(kWest, 12, 1, StateAt(0.2, 6));
  EXPECT_NEAR(ShownAt(10), 0, 1e-12);
  EXPECT_NEAR(ShownAt(11), 0.1, 1e-12);
  EXPECT_NEAR(ShownAt(12), 0.2, 1e-12);
  EXPECT_EQ(view.extrapolations(), 0u);
}

TEST_F(WorldViewTest, BeyondTheNewestItGoesOnAlongItsVelocityForAWhile) {
  Body(kWest, 10, 1, StateAt(0, 6));
  EXPECT_NEAR(ShownAt(13), 0.3, 1e-6);
  EXPECT_TRUE(view.At(13, 60).at(0).extrapolated);
  EXPECT_NEAR(ShownAt(1000), 6 * 0.25, 1e-6);  // no further than kMaxExtrapolation
  EXPECT_EQ(view.extrapolations(), 3u);
}

TEST_F(WorldViewTest, ABodyAtRestStandsUntilItIsWoken) {
  Body(kWest, 10, 1, StateAt(1));
  EXPECT_EQ(ShownAt(100), 1);
  Body(kWest, 200, 1, StateAt(1.5, 3));
  EXPECT_NEAR(ShownAt(150), 1, 1e-12);  // not on its way since tick 10
  EXPECT_NEAR(ShownAt(198), 1, 1e-12);
  EXPECT_NEAR(ShownAt(199), 1.25, 1e-12);
  EXPECT_EQ(view.extrapolations(), 0u);
}

TEST_F(WorldViewTest, OrientationTakesTheShorterArc) {
  BodyState from = StateAt(0), to = StateAt(0);
  from.angular_velocity = to.angular_velocity = {0, 1, 0};
  const float angle = 0.4f;
  to.orientation = {0, -std::sin(angle / 2), 0, -std::cos(angle / 2)};  // the same rotation, opposite sign
  Body(kWest, 10, 1, from);
  Body(kWest, 12, 1, to);
  const Quatd q = view.At(11, 60).at(0).pose.orientation;
  EXPECT_NEAR(2 * std::atan2(std::abs(q.y), std::abs(q.w)), angle / 2, 1e-3);
}

// It moves steadily; every fifth state comes after the next one has, and one at which the picture has already been.
TEST_F(WorldViewTest, IsWhereItWasHoweverManyStatesHaveComeAndGone) {
  const auto at = [](std::uint64_t tick) { return StateAt(0.5 * static_cast<double>(tick), 30); };
  Body(kWest, 0, 1, at(0));
  for (std::uint64_t tick = 2; tick < 1000; tick += 2) {
    const bool waits = tick % 10 == 0, late = tick % 10 == 2 && tick > 2;
    if (!waits) Body(kWest, tick, 1, at(tick));
    if (late) Body(kWest, tick - 2, 1, at(tick - 2));
    if (late && tick > 20) Body(kWest, tick - 16, 1, at(tick - 16));
    if (tick < 12 || waits) continue;
    const double shown = static_cast<double>(tick) - 5.5;
    ASSERT_NEAR(ShownAt(shown), 0.5 * shown, 1e-9) << tick;
  }
  EXPECT_EQ(view.extrapolations(), 0u);
}

TEST_F(WorldViewTest, BodiesAreShownInTheOrderOfTheirIdsWhoeverComesAndGoes) {
  const auto shown = [&] {
    std::vector<std::uint64_t> ids;
    for (const ShownBody& body : view.At(10, 60)) ids.push_back(body.id.value());
    return ids;
  };
  const auto come = [&](std::initializer_list<std::uint64_t> ids) {
    ReceivedSnapshot snapshot;
    snapshot.tick = Tick(10);
    for (const std::uint64_t id : ids) snapshot.bodies.push_back({BodyId(id), Epoch(1), StateAt(1)});
    view.Take(kNow, kWest, snapshot, events);
  };
  come({5, 9});
  come({2, 7});
  EXPECT_EQ(shown(), (std::vector<std::uint64_t>{2, 5, 7, 9}));
  Departs(kWest, 12, 1, RegionId());
  EXPECT_EQ(shown(), (std::vector<std::uint64_t>{2, 5, 9}));
  come({3, 12});
  EXPECT_EQ(shown(), (std::vector<std::uint64_t>{2, 3, 5, 9, 12}));
  view.Clear(events);
  EXPECT_TRUE(shown().empty());
}

TEST_F(WorldViewTest, EachBodyExpiresAtItsOwnTime) {
  view.RegionBegins(kNow, kEast);
  ReceivedSnapshot snapshot;
  snapshot.tick = Tick(10);
  for (std::uint64_t id = 6; id <= 9; ++id) snapshot.bodies.push_back({BodyId(id), Epoch(1), StateAt(1)});
  view.Take(kNow, kWest, snapshot, events);
  const auto departs = [&](std::chrono::milliseconds after, std::uint64_t id) {
    ReceivedSnapshot leaving;
    leaving.tick = Tick(12);
    leaving.departures.push_back({BodyId(id), Epoch(1), kEast});
    view.Take(kNow + after, kWest, leaving, events);
  };
  constexpr std::chrono::milliseconds kLater{500};
  departs(kLater, 8);
  departs(std::chrono::milliseconds(0), 7);
  departs(std::chrono::milliseconds(0), 6);
  Body(kEast, 14, 2, StateAt(2));  // 7 has an owner again
  view.Expire(kNow + WorldView::kGrace, events);
  EXPECT_FALSE(view.bodies().contains(BodyId(6)));
  EXPECT_TRUE(view.bodies().contains(BodyId(8)));
  view.Expire(kNow + WorldView::kGrace + kLater, events);
  EXPECT_FALSE(view.bodies().contains(BodyId(8)));
  EXPECT_EQ(view.At(14, 60).size(), 2u) << "7 and 9";
}

}  // namespace
}  // namespace tessera::client
